// Outputs that could not be written. One of them does not prevent the others: it is reported, and missing in the end.
#pragma once

#include "base/result.hpp"

#include <cstddef>
#include <string>
#include <vector>

namespace trocar::engine {

class MissingOutputs {
public:
    /// Result of writing `what` (a name in the output folder). Success after a failure, of what is written whole each time, takes the
    /// failure back. True: this output has begun to be missing with it.
    bool note(const std::string& what, const Result<void>& written);
    /// One of several files that go by one name; no later success restores it.
    bool add(const std::string& what, const Error& error);

    [[nodiscard]] bool empty() const noexcept { return outputs_.empty(); }
    /// A sentence for each: its name, the file and the system's reason.
    [[nodiscard]] std::vector<std::string> sentences() const;

private:
    struct Output {
        std::string what;
        Error first;
        std::size_t count = 0; // files
    };
    std::vector<Output> outputs_; // in the order in which they began to be missing
};

} // namespace trocar::engine
