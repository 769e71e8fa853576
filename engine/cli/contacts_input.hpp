// Options and input of `contacts`: two frames of one mesh or two, or a sequence of frames.
#pragma once

#include "base/result.hpp"
#include "collision/topology.hpp"
#include "engine/io/frames.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

struct ContactsRequest {
    std::vector<std::string> meshes;
    std::string frames, method = "exact", out, stats, dump;
    bool self = false, coherent = false, compare = false;
    double distance = 0.0;
    unsigned threads = 1;
};

/// Coordinates beyond it would overflow in a product of three.
inline constexpr double kLargestContactCoordinate = 1e100;

struct ContactsInput {
    std::vector<collision::SurfaceTopology> surfaces;
    std::vector<std::vector<Vec3>> t0, t1; // two frames: [surface]; a sequence is read from `sequence`
    FrameSequence sequence;
    [[nodiscard]] bool is_sequence() const noexcept { return sequence.frame_count > 0; }
};

/// An error of the command line; `key` is the option.
[[nodiscard]] Error bad_usage(std::string message, std::string key = {});

/// Options that go together, outputs that are neither inputs nor one another.
[[nodiscard]] Result<void> check_contacts_usage(const ContactsRequest& request);

/// fails     with the file: unreadable, frames that are not of one mesh, coordinates beyond kLargestContactCoordinate
[[nodiscard]] Result<ContactsInput> read_contacts_input(const ContactsRequest& request);

} // namespace trocar::engine
