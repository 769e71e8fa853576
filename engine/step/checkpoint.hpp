// A run on the disk, to go on from there: with the same scene, budget and build it ends in the same bits as if it had never stopped,
// wherever a budget is not a time. (Under one the rates of the clock are learnt anew, as in any run.)
//
// Binary: a line that names the kind of file, its version, the hash of the prepared scene, name, budget, step, what the step leaves
// to the next (state_bytes.hpp), and a hash of all bytes before it.
#pragma once

#include "base/result.hpp"
#include "engine/step/simulator.hpp"

#include <filesystem>
#include <string>

namespace trocar::engine {

struct Checkpoint {
    std::uint64_t model_hash = 0; // hash_model of the scene
    std::string scene;            // its name
    BudgetLimits limits;
    std::uint64_t step = 0; // steps done
    std::string state;      // append_state
};

[[nodiscard]] Checkpoint make_checkpoint(Simulator& simulator);

[[nodiscard]] std::string checkpoint_bytes(const Checkpoint& checkpoint);
/// fails  BadSyntax: another kind of file, another version, cut off, changed
[[nodiscard]] Result<Checkpoint> parse_checkpoint(std::string_view bytes, const std::filesystem::path& file);

/// Written complete or not at all.
[[nodiscard]] Result<void> write_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint);
[[nodiscard]] Result<Checkpoint> read_checkpoint(const std::filesystem::path& file);

/// The simulator, fresh, goes on where the checkpoint was made.
/// fails  BadValue: made of another scene, or of one that was prepared otherwise; the simulator takes no step any more
[[nodiscard]] Result<void> resume(Simulator& simulator, const Checkpoint& checkpoint, const std::filesystem::path& file);

} // namespace trocar::engine
