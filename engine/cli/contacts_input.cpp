#include "engine/cli/contacts_input.hpp"

#include "engine/cli/taken_files.hpp"
#include "engine/io/read_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

namespace trocar::engine {

namespace {

Result<void> check_size(std::span<const Vec3> positions, const std::string& file) {
    for (std::size_t v = 0; v < positions.size(); ++v)
        if (!(positions[v].cwiseAbs().maxCoeff() <= kLargestContactCoordinate))
            return Error{ErrorCode::BadValue, fmt::format("vertex {} lies beyond {:g}", v, kLargestContactCoordinate), file};
    return {};
}

/// Two frames of one mesh: same vertices, same triangles in the same order.
Result<void> read_pair(const std::string& file_t0, const std::string& file_t1, ContactsInput& input) {
    auto t0 = read_surface(file_t0), t1 = read_surface(file_t1);
    if (!t0) return t0.error();
    if (!t1) return t1.error();
    if (t0->vertices.size() != t1->vertices.size())
        return Error{
            ErrorCode::BadMesh,
            fmt::format("has {} vertices, {} has {}: two frames of one mesh are wanted", t1->vertices.size(), file_t0, t0->vertices.size()),
            file_t1};
    if (t0->triangles.size() != t1->triangles.size())
        return Error{ErrorCode::BadMesh,
                     fmt::format("has {} triangles, {} has {}: two frames of one mesh are wanted", t1->triangles.size(), file_t0,
                                 t0->triangles.size()),
                     file_t1};
    const auto [first, other] = std::mismatch(t0->triangles.begin(), t0->triangles.end(), t1->triangles.begin());
    if (first != t0->triangles.end())
        return Error{ErrorCode::BadMesh,
                     fmt::format("triangle {} is {} {} {}, in {} it is {} {} {}: two frames of one mesh are wanted",
                                 first - t0->triangles.begin(), (*other)[0], (*other)[1], (*other)[2], file_t0, (*first)[0], (*first)[1],
                                 (*first)[2]),
                     file_t1};
    if (const auto sized = check_size(t0->vertices, file_t0); !sized) return sized;
    if (const auto sized = check_size(t1->vertices, file_t1); !sized) return sized;
    input.surfaces.push_back(collision::make_topology(t0->triangles, t0->vertices.size()));
    input.t0.push_back(std::move(t0->vertices));
    input.t1.push_back(std::move(t1->vertices));
    return {};
}

/// An output file must be neither an input nor another output.
Result<void> check_outputs(const ContactsRequest& request) {
    std::vector<std::filesystem::path> taken(request.meshes.begin(), request.meshes.end());
    if (!request.frames.empty())
        for (const char* name : {"meta.txt", "tris.i32", "obj.i32", "pos.f64"})
            taken.push_back(std::filesystem::path(request.frames) / name);
    const std::pair<const char*, const std::string&> outputs[] = {
        {"--out", request.out}, {"--stats", request.stats}, {"--dump", request.dump}};
    for (const auto& [option, file] : outputs) {
        if (file.empty()) continue;
        if (const auto fine = check_not_taken(file, taken, option); !fine.ok()) return fine;
        taken.emplace_back(file);
    }
    return {};
}

} // namespace

Error bad_usage(std::string message, std::string key) { return {ErrorCode::BadUsage, std::move(message), {}, 0, 0, std::move(key)}; }

Result<void> check_contacts_usage(const ContactsRequest& request) {
    const std::size_t meshes = request.meshes.size();
    if (!request.frames.empty() && meshes > 0) return bad_usage("--frames stands for meshes; give one or the other", "--frames");
    if (request.frames.empty() && meshes != 2 && meshes != 4)
        return bad_usage(
            fmt::format("{} meshes; two frames of one mesh (A0 A1) or of two (A0 A1 B0 B1) are wanted, or --frames DIR", meshes));
    if (!request.dump.empty() && request.frames.empty()) return bad_usage("goes with --frames", "--dump");
    if (request.compare && !request.coherent)
        return bad_usage("compares steps with and without what is kept: with --coherent", "--compare");
    if (request.compare && (!request.out.empty() || !request.dump.empty()))
        return bad_usage("tells times only; ask for contacts in a run of their own", "--compare");
    if (request.coherent && request.frames.empty()) return bad_usage("goes with --frames: one step has none before it", "--coherent");
    if (request.coherent && request.threads > 1) return bad_usage("runs on one thread", "--coherent");
    if (const auto apart = check_outputs(request); !apart) return apart;
    if (!(request.distance >= 0.0 && request.distance <= kLargestContactCoordinate))
        return bad_usage("a number from 0 up is wanted", "--distance");
    return {};
}

Result<ContactsInput> read_contacts_input(const ContactsRequest& request) {
    ContactsInput input;
    if (!request.frames.empty()) {
        auto frames = read_frames(request.frames);
        if (!frames) return frames.error();
        for (std::size_t frame = 0; frame < frames->frame_count; ++frame)
            if (const auto sized = check_size(frames->frame(frame), fmt::format("{}/pos.f64, frame {}", request.frames, frame)); !sized)
                return sized.error();
        input.sequence = std::move(*frames);
        input.surfaces.push_back(collision::make_topology(input.sequence.triangles, input.sequence.vertex_count()));
        return input;
    }
    for (std::size_t i = 0; i < request.meshes.size(); i += 2)
        if (const auto read = read_pair(request.meshes[i], request.meshes[i + 1], input); !read) return read.error();
    return input;
}

} // namespace trocar::engine
