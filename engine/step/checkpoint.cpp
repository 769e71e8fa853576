#include "engine/step/checkpoint.hpp"

#include "engine/state/state.hpp"
#include "engine/step/model_hash.hpp"
#include "engine/state/state_bytes.hpp"

#include <fmt/format.h>

namespace trocar::engine {

Checkpoint make_checkpoint(Simulator& simulator) {
    Checkpoint checkpoint{hash_model(simulator.model()), simulator.model().name, simulator.budget(), simulator.state().step, {}};
    append_state(simulator.state(), checkpoint.state);
    return checkpoint;
}

Result<void> resume(Simulator& simulator, const Checkpoint& checkpoint, const std::filesystem::path& file) {
    const auto wrong = [&](std::string message) { return Error{ErrorCode::BadValue, std::move(message), file.string()}; };
    const SceneModel& model = simulator.model();
    if (const std::uint64_t hash = hash_model(model); checkpoint.model_hash != hash)
        return wrong(fmt::format("was made of another scene, \"{}\" ({:016x}); this one is \"{}\" ({:016x}), prepared from its meshes "
                                 "and paths as they are now: undo what was changed since, or start anew without --resume",
                                 checkpoint.scene, checkpoint.model_hash, model.name, hash));
    Result<State> state = read_state(model, checkpoint.state);
    if (!state) return wrong("the checkpoint cannot be used: " + state.error().message);
    if (state->step != checkpoint.step) return wrong("the checkpoint's head and its state are of different steps");
    return simulator.restore(*state);
}

} // namespace trocar::engine
