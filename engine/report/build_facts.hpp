// Which program wrote an output.
#pragma once

#include "engine/report/places.hpp"

#include <string>

namespace trocar::engine {

struct BuildFacts {
    std::string version; // "1.0.0"
    std::string commit;  // of the sources; "unknown" in programs that did not say
};
[[nodiscard]] const BuildFacts& build_facts();

/// Once, before anything is written: the program knows its commit, the library does not. Empty: unknown.
void name_commit(const std::string& commit);

/// "trocar 1.0.0, commit 0123456789ab".
[[nodiscard]] std::string build_text();

/// Program, machine and compiler, as entries of a page's <dl>.
[[nodiscard]] std::string facts_html(const Machine& machine);

} // namespace trocar::engine
