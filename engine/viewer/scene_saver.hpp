// Saves scenes with picked places on a thread of its own: reading and preparing one takes seconds, and no viewer waits for it.
#pragma once

#include "engine/viewer/picked_scene.hpp"

#include <future>
#include <optional>
#include <string>

namespace trocar::engine::viewer {

class SceneSaver {
public:
    struct Answer {
        unsigned client = 0; // who asked
        Result<SavedScene> saved;
    };

    /// scene  must outlive it; its file is read now, so that what is saved is what is shown
    explicit SceneSaver(const Scene& scene);

    /// The sentence that refuses it, because another scene is being saved; empty: it has begun.
    [[nodiscard]] std::string start(unsigned client, const Picks& picks, const SaveScene& asked);
    /// None: nothing was asked for, or it is not done yet.
    [[nodiscard]] std::optional<Answer> take();

private:
    const Scene& scene_;
    std::string text_; // of the scene's file; empty: it came from none
    unsigned client_ = 0;
    std::future<Result<SavedScene>> saving_;
};

} // namespace trocar::engine::viewer
