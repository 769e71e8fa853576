#include "engine/step/checkpoint.hpp"

#include "engine/step/model_hash.hpp"
#include "engine/step/step_memory.hpp"

#include <fmt/format.h>

namespace trocar::engine {

Checkpoint make_checkpoint(const Simulator& simulator) {
    Checkpoint checkpoint{hash_model(simulator.model()), simulator.model().name, simulator.budget(), simulator.state().step, {}};
    append_step_memory(simulator.model(), simulator.state(), simulator.context(), checkpoint.memory);
    return checkpoint;
}

Result<void> resume(Simulator& simulator, const Checkpoint& checkpoint, const std::filesystem::path& file) {
    const auto wrong = [&](std::string message) { return Error{ErrorCode::BadValue, std::move(message), file.string()}; };
    const SceneModel& model = simulator.model();
    if (const std::uint64_t hash = hash_model(model); checkpoint.model_hash != hash)
        return wrong(fmt::format("was made of another scene, \"{}\" ({:016x}); this one is \"{}\" ({:016x}), prepared from its meshes "
                                 "and paths as they are now: undo what was changed since, or start anew without --resume",
                                 checkpoint.scene, checkpoint.model_hash, model.name, hash));
    if (const std::string misfit = simulator.take_over(checkpoint.memory); !misfit.empty())
        return wrong("the checkpoint cannot be used: " + misfit);
    if (simulator.state().step != checkpoint.step) return wrong("the checkpoint's head and its state are of different steps");
    return {};
}

} // namespace trocar::engine
