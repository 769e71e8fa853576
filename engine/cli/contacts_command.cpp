// `contacts`: the exact contacts of one step between two frames of one or two meshes, or of every step of a sequence of frames.
#include "collision/coherent_search.hpp"
#include "collision/contact_search.hpp"
#include "engine/cli/commands.hpp"
#include "engine/cli/contact_method.hpp"
#include "engine/cli/image_space_contacts.hpp"
#include "engine/cli/progress.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/io/contact_rows.hpp"
#include "engine/io/frames.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/time/clock.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <memory>

namespace seldinger::engine {

namespace {

using collision::ContactSearch;
using collision::SearchContact;
using collision::SurfaceMotion;
using collision::SurfaceTopology;

struct Request {
    std::vector<std::string> meshes;
    std::string frames, method = "exact", out, stats, dump;
    bool self = false, coherent = false;
    double distance = 0.0;
    unsigned threads = 1;
};

/// At a distance, pairs up to this part of it farther apart may be reported as well.
constexpr double kDistanceTolerance = 1e-9;
/// Coordinates beyond it would overflow in a product of three.
constexpr double kLargestCoordinate = 1e100;
/// Pairs of features that `brute` decides at most.
constexpr double kMostBrutePairs = 3e7;

Error bad_usage(std::string message, std::string key = {}) { return {ErrorCode::BadUsage, std::move(message), {}, 0, 0, std::move(key)}; }

struct Input {
    std::vector<SurfaceTopology> surfaces;
    std::vector<std::vector<Vec3>> t0, t1; // two frames: [surface]; a sequence is read from `sequence`
    FrameSequence sequence;
    [[nodiscard]] bool is_sequence() const noexcept { return sequence.frame_count > 0; }
};

Result<void> check_size(std::span<const Vec3> positions, const std::string& file) {
    for (std::size_t v = 0; v < positions.size(); ++v)
        if (!(positions[v].cwiseAbs().maxCoeff() <= kLargestCoordinate))
            return Error{ErrorCode::BadValue, fmt::format("vertex {} lies beyond {:g}", v, kLargestCoordinate), file};
    return {};
}

/// Two frames of one mesh: same vertices, same triangles in the same order.
Result<void> read_pair(const std::string& file_t0, const std::string& file_t1, Input& input) {
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

Result<Input> read_input(const Request& request) {
    Input input;
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

/// What is written must not be what is read, nor one another.
Result<void> check_outputs(const Request& request) {
    std::vector<std::filesystem::path> taken(request.meshes.begin(), request.meshes.end());
    if (!request.frames.empty())
        for (const char* name : {"meta.txt", "tris.i32", "obj.i32", "pos.f64"})
            taken.push_back(std::filesystem::path(request.frames) / name);
    const std::pair<const char*, const std::string&> outputs[] = {
        {"--out", request.out}, {"--stats", request.stats}, {"--dump", request.dump}};
    for (const auto& [option, file] : outputs) {
        if (file.empty()) continue;
        for (const std::filesystem::path& other : taken) {
            std::error_code unknown; // a file that is not there yet is like none
            if (std::filesystem::equivalent(file, other, unknown) ||
                std::filesystem::path(file).lexically_normal() == other.lexically_normal())
                return bad_usage(fmt::format("{} is read, or written by another option; another file is wanted", file), option);
        }
        taken.emplace_back(file);
    }
    return {};
}

Result<void> check_usage(const Request& request) {
    const std::size_t meshes = request.meshes.size();
    if (!request.frames.empty() && meshes > 0) return bad_usage("--frames stands for meshes; give one or the other", "--frames");
    if (request.frames.empty() && meshes != 2 && meshes != 4)
        return bad_usage(
            fmt::format("{} meshes; two frames of one mesh (A0 A1) or of two (A0 A1 B0 B1) are wanted, or --frames DIR", meshes));
    if (!request.dump.empty() && request.frames.empty()) return bad_usage("goes with --frames", "--dump");
    if (request.coherent && request.frames.empty()) return bad_usage("goes with --frames: one step has none before it", "--coherent");
    if (request.coherent && request.threads > 1) return bad_usage("runs on one thread", "--coherent");
    if (const auto apart = check_outputs(request); !apart) return apart;
    if (!(request.distance >= 0.0 && request.distance <= kLargestCoordinate))
        return bad_usage("a number from 0 up is wanted", "--distance");
    return {};
}

double pair_count(const Input& input, const collision::SearchOptions& options) {
    double pairs = 0.0;
    for (std::size_t a = 0; a < input.surfaces.size(); ++a)
        for (std::size_t b = a; b < input.surfaces.size(); ++b) {
            if (!(a == b ? options.within : options.between)) continue;
            const SurfaceTopology &x = input.surfaces[a], &y = input.surfaces[b];
            const auto size = [](const auto& list) { return static_cast<double>(list.size()); };
            pairs += size(x.vertex_owner) * size(y.triangles) + size(x.edges) * size(y.edges) * (a == b ? 0.5 : 1.0);
            if (a != b) pairs += size(y.vertex_owner) * size(x.triangles);
        }
    return pairs;
}

/// What one step cost and found.
struct StepRow {
    std::size_t frame = 0;
    collision::ExactStats stats;
    double refit_ms = 0.0, broad_ms = 0.0, cull_ms = 0.0, narrow_ms = 0.0;
    std::size_t near_pairs = 0, left_pairs = 0; // of triangles, before and after culling by sets
    collision::CoherenceStats coherence;        // with --coherent
    [[nodiscard]] double total_ms() const noexcept { return refit_ms + broad_ms + cull_ms + narrow_ms; }
};

ContactRow row_of(const SearchContact& found, std::span<const std::int32_t> objects) {
    const Contact& c = found.contact;
    const bool vertex_face = c.origin == ContactOrigin::ExactVF;
    ContactRow row;
    row.kind = vertex_face ? ContactKind::VF : ContactKind::EE;
    row.body_a = objects.empty() ? c.body_a : objects[c.feature_a[0]];
    row.body_b = objects.empty() ? c.body_b : objects[c.feature_b[0]];
    row.feature_a0 = c.feature_a[0];
    row.feature_b0 = c.feature_b[0];
    row.feature_b1 = c.feature_b[1];
    if (vertex_face)
        row.feature_b2 = c.feature_b[2];
    else
        row.feature_a1 = c.feature_a[1];
    row.time = c.time;
    row.bary_a = vertex_face ? 0.0 : c.bary_a[1];
    row.bary_b0 = c.bary_b[0];
    row.bary_b1 = c.bary_b[1];
    row.normal = c.normal;
    return row;
}

class Run {
public:
    Run(const Request& request, const ContactMethod& method, Input input) : request_(request), method_(method), input_(std::move(input)) {
        options_.within = request.self || input_.is_sequence() || input_.surfaces.size() == 1;
        options_.distance = request.distance;
        options_.tolerance = kDistanceTolerance * request.distance;
        options_.tree = method.tree;
        options_.simd = method.simd;
        options_.all_pairs = method.brute;
        options_.threads = request.threads;
    }

    int run() {
        if (method_.brute && pair_count(input_, options_) > kMostBrutePairs)
            return report_error(bad_usage(
                fmt::format("brute would decide {:.3g} pairs; at most {:g} are tried", pair_count(input_, options_), kMostBrutePairs),
                "--method"));
        if (const auto built = build(); !built) return report_error(built.error());
        const std::size_t steps = input_.is_sequence() ? input_.sequence.frame_count - 1 : 1;
        ProgressLine progress(true);
        for (std::size_t k = 0; k < steps; ++k) {
            if (steps > 1) progress.show(fmt::format("step {} of {}", k + 1, steps));
            if (const auto done = step(k); !done) return report_error(done.error());
        }
        progress.clear();
        if (const auto written = write(); !written) return report_error(written.error());
        print();
        return kExitFine;
    }

private:
    std::vector<SurfaceMotion> motions(std::size_t k) const {
        if (input_.is_sequence()) return {{&input_.surfaces[0], input_.sequence.frame(k), input_.sequence.frame(k + 1)}};
        std::vector<SurfaceMotion> out;
        for (std::size_t i = 0; i < input_.surfaces.size(); ++i) out.push_back({&input_.surfaces[i], input_.t0[i], input_.t1[i]});
        return out;
    }

    Result<void> build() {
        StopWatch watch;
        std::vector<const SurfaceTopology*> surfaces;
        std::vector<std::span<const Vec3>> positions;
        for (const SurfaceMotion& motion : motions(0)) {
            surfaces.push_back(motion.topology);
            positions.push_back(motion.t0);
        }
        if (request_.coherent) {
            if (const auto built = build_coherent(surfaces, positions); !built) return built;
        } else {
            search_.build(surfaces, positions, options_);
        }
        if (method_.culling)
            culled_ = std::make_unique<CulledSearch>(surfaces, positions,
                                                     CulledSearch::Options{.method = *method_.culling,
                                                                           .within = options_.within,
                                                                           .between = options_.between,
                                                                           .distance = options_.distance,
                                                                           .tolerance = options_.tolerance,
                                                                           .plan = {},
                                                                           .contexts = {}});
        build_ms_ = watch.lap_ms();
        return {};
    }

    Result<void> build_coherent(std::span<const SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions) {
        if (method_.culling || method_.brute)
            return bad_usage(fmt::format("keeps what the hierarchy finds; it does not go with --method {}", request_.method), "--coherent");
        collision::CoherentOptions options;
        static_cast<collision::PairOptions&>(options) = options_;
        options.between = options_.between;
        options.within = options_.within;
        options.tree = options_.tree;
        coherent_ = std::make_unique<collision::CoherentSearch>();
        auto built = coherent_->build(surfaces, positions, options);
        if (!built) return bad_usage(built.error().message, "--coherent");
        return {};
    }

    Result<void> step_coherently(std::span<const SurfaceMotion> motions, StepRow& row, StopWatch& watch) {
        if (auto started = coherent_->start_step(motions); !started) return started;
        row.refit_ms = watch.lap_ms();
        coherent_->find_candidates();
        row.broad_ms = watch.lap_ms();
        coherent_->decide(found_);
        row.narrow_ms = watch.lap_ms();
        row.stats = coherent_->stats();
        row.coherence = coherent_->coherence();
        return {};
    }

    /// The candidates of a step, by sets: what the hierarchy would find and more is culled.
    void cull(std::span<const SurfaceMotion> step, StepRow& row) {
        const CullTimes times = culled_->find_candidates(step);
        search_.start_given(step);
        for (const CulledSearch::Job& job : culled_->jobs()) {
            search_.give_candidates(job.a, job.b, job.candidates.vertex_face, job.candidates.face_vertex, job.candidates.edge_edge);
            row.near_pairs += job.culler->counts().near_pairs;
            row.left_pairs += job.culler->counts().left_pairs;
        }
        row.refit_ms = times.refit_ms;
        row.broad_ms = times.near_ms + times.collect_ms;
        row.cull_ms = times.look_ms;
    }

    void step_anew(std::span<const SurfaceMotion> motions, StepRow& row, StopWatch& watch) {
        if (culled_) {
            cull(motions, row);
            [[maybe_unused]] const double culled_ms = watch.lap_ms();
        } else {
            search_.refit(motions);
            row.refit_ms = watch.lap_ms();
            search_.find_candidates();
            row.broad_ms = watch.lap_ms();
        }
        search_.decide(found_);
        row.narrow_ms = watch.lap_ms();
        if (culled_) culled_->note_tests(row.narrow_ms);
        row.stats = search_.stats();
    }

    Result<void> step(std::size_t k) {
        const std::vector<SurfaceMotion> moved = motions(k);
        StopWatch watch;
        StepRow row;
        row.frame = k;
        if (!coherent_)
            step_anew(moved, row, watch);
        else if (auto done = step_coherently(moved, row, watch); !done)
            return done;
        rows_.push_back(row);
        if (!request_.out.empty()) {
            ContactStep contacts{k, {}};
            for (const SearchContact& found : found_) contacts.rows.push_back(row_of(found, input_.sequence.objects));
            contacts_.push_back(std::move(contacts));
        }
        if (request_.dump.empty()) return {};
        for (const SearchContact& found : found_)
            hits_.push_back({static_cast<std::int32_t>(k), found.contact.origin == ContactOrigin::ExactVF ? 0 : 1,
                             static_cast<std::int32_t>(found.id_a), static_cast<std::int32_t>(found.id_b), found.contact.time});
        return {};
    }

    template <class Of>
    auto median(const Of& of) const {
        std::vector<decltype(of(rows_[0]))> values;
        for (const StepRow& row : rows_) values.push_back(of(row));
        std::sort(values.begin(), values.end());
        return values[values.size() / 2];
    }

    std::string method_name() const { return method_.name() + (coherent_ ? "-coherent" : ""); }

    std::size_t session_count() const {
        return static_cast<std::size_t>(
            std::count_if(rows_.begin(), rows_.end(), [](const StepRow& r) { return r.coherence.began_session; }));
    }

    nlohmann::ordered_json stats_json() const {
        nlohmann::ordered_json json;
        const auto count = [&](auto member) { return median([member](const StepRow& r) { return r.stats.*member; }); };
        using Stats = collision::ExactStats;
        json["method"] = method_name();
        json["candidates_vf"] = count(&Stats::candidates_vf);
        json["candidates_ee"] = count(&Stats::candidates_ee);
        json["hits_vf"] = count(&Stats::hits_vf);
        json["hits_ee"] = count(&Stats::hits_ee);
        json["unresolved"] = count(&Stats::unresolved);
        json["exact"] = count(&Stats::exact);
        json["cluster_pairs"] = count(&Stats::cluster_pairs);
        json["build_ms"] = build_ms_;
        json["refit_ms"] = median([](const StepRow& r) { return r.refit_ms; });
        json["broad_ms"] = median([](const StepRow& r) { return r.broad_ms; });
        json["cull_ms"] = median([](const StepRow& r) { return r.cull_ms; });
        json["narrow_ms"] = median([](const StepRow& r) { return r.narrow_ms; });
        json["total_ms"] = median([](const StepRow& r) { return r.total_ms(); });
        json["colours"] = culled_ ? culled_->colours() : 0;
        if (culled_) {
            json["culler"] = culled_->backend();
            json["near_pairs"] = median([](const StepRow& r) { return r.near_pairs; });
            json["left_pairs"] = median([](const StepRow& r) { return r.left_pairs; });
            json["notes"] = culled_->notes();
        }
        json["distance"] = request_.distance;
        json["threads"] = request_.threads;
        std::size_t memory = 0;
        for (const collision::DopTree& tree : search_.trees()) memory += tree.memory();
        if (coherent_) {
            memory = coherent_->memory();
            json["kept_cluster_pairs"] = median([](const StepRow& r) { return r.coherence.kept_clusters; });
            json["kept_feature_pairs"] = median([](const StepRow& r) { return r.coherence.kept_features; });
            json["looked_at"] = median([](const StepRow& r) { return r.coherence.awake; });
            json["sessions"] = session_count();
        }
        json["tree_bytes"] = memory;
        if (!input_.is_sequence()) return json;
        for (const StepRow& r : rows_)
            json["steps"].push_back({{"frame", r.frame},
                                     {"candidates_vf", r.stats.candidates_vf},
                                     {"candidates_ee", r.stats.candidates_ee},
                                     {"hits_vf", r.stats.hits_vf},
                                     {"hits_ee", r.stats.hits_ee},
                                     {"unresolved", r.stats.unresolved},
                                     {"exact", r.stats.exact},
                                     {"refit_ms", r.refit_ms},
                                     {"broad_ms", r.broad_ms},
                                     {"cull_ms", r.cull_ms},
                                     {"narrow_ms", r.narrow_ms},
                                     {"total_ms", r.total_ms()}});
        return json;
    }

    Result<void> write() const {
        if (!request_.out.empty())
            if (const auto written = write_file_atomically(request_.out, contact_csv(contacts_, input_.is_sequence())); !written)
                return written;
        if (!request_.dump.empty())
            if (const auto written = write_hits(request_.dump, hits_); !written) return written;
        if (!request_.stats.empty()) return write_file_atomically(request_.stats, stats_json().dump(2) + "\n");
        return {};
    }

    void print() const {
        std::uint64_t vf = 0, ee = 0, unresolved = 0, exact = 0;
        for (const StepRow& r : rows_) {
            vf += r.stats.hits_vf;
            ee += r.stats.hits_ee;
            unresolved += r.stats.unresolved;
            exact += r.stats.exact;
        }
        const char* per_step = rows_.size() > 1 ? ", medians of a step" : "";
        const auto json = stats_json();
        fmt::print("{}: {} candidates VF, {} EE{}\n", method_name(), json["candidates_vf"].get<std::uint64_t>(),
                   json["candidates_ee"].get<std::uint64_t>(), per_step);
        fmt::print("build {:.2f} ms, refit {:.2f}, broad {:.2f}, narrow {:.2f}, total {:.2f} ms without the build{}\n", build_ms_,
                   json["refit_ms"].get<double>(), json["broad_ms"].get<double>(), json["narrow_ms"].get<double>(),
                   json["total_ms"].get<double>(), per_step);
        if (culled_) {
            fmt::print("{} sets; pairs of triangles that are near: {}, left after culling by {}: {}, in {:.2f} ms{}\n", culled_->colours(),
                       json["near_pairs"].get<std::size_t>(), culled_->backend(), json["left_pairs"].get<std::size_t>(),
                       json["cull_ms"].get<double>(), per_step);
            for (const std::string& note : culled_->notes()) fmt::print("note: {}\n", note);
        }
        if (coherent_)
            fmt::print("{} sessions; kept: {} pairs of clusters, {} of features{}; {:.1f} MB\n", session_count(),
                       json["kept_cluster_pairs"].get<std::uint64_t>(), json["kept_feature_pairs"].get<std::uint64_t>(), per_step,
                       1e-6 * json["tree_bytes"].get<double>());
        fmt::print("{} steps, {} contacts: {} VF, {} EE; {} candidates decided in whole numbers, {} unresolved\n", rows_.size(), vf + ee,
                   vf, ee, exact, unresolved);
    }

    const Request& request_;
    const ContactMethod& method_;
    Input input_;
    collision::SearchOptions options_;
    ContactSearch search_;
    std::unique_ptr<CulledSearch> culled_;                // by chromatic sets, if the method says so
    std::unique_ptr<collision::CoherentSearch> coherent_; // instead of search_, with --coherent
    double build_ms_ = 0.0;
    std::vector<StepRow> rows_;
    std::vector<SearchContact> found_;
    std::vector<ContactStep> contacts_;
    std::vector<HitRecord> hits_;
};

nlohmann::ordered_json crossing_json(const CrossingAnswer& answer, const ContactMethod& method) {
    nlohmann::ordered_json json = {{"method", method.name()},
                                   {"candidates_vf", 0},
                                   {"candidates_ee", 0},
                                   {"hits_vf", 0},
                                   {"hits_ee", 0},
                                   {"hits_tt", answer.rows.size()},
                                   {"unresolved", 0},
                                   {"triangles", answer.triangles},
                                   {"left_triangles", answer.left},
                                   {"build_ms", answer.build_ms},
                                   {"refit_ms", 0.0},
                                   {"broad_ms", 0.0},
                                   {"cull_ms", answer.cull_ms},
                                   {"narrow_ms", answer.narrow_ms},
                                   {"total_ms", answer.cull_ms + answer.narrow_ms},
                                   {"colours", answer.colours},
                                   {"culler", answer.culler},
                                   {"notes", answer.notes}};
    for (const auto& pass : answer.passes)
        json["passes"].push_back({{"direction", {pass.direction[0], pass.direction[1], pass.direction[2]}},
                                  {"triangles", pass.triangles},
                                  {"left", pass.triangles_left},
                                  {"questions", pass.questions}});
    return json;
}

/// Triangles that cross, of meshes that stand still.
int find_crossings_of(const Request& request, const ContactMethod& method, const Input& input) {
    if (input.is_sequence() || request.distance > 0.0)
        return report_error(bad_usage("image-space takes one or two meshes that stand still, without --frames and --distance", "--method"));
    for (std::size_t i = 0; i < input.t0.size(); ++i)
        if (input.t0[i] != input.t1[i])
            return report_error(
                bad_usage(fmt::format("{} and {} differ; image-space takes meshes that stand still: name the same file twice",
                                      request.meshes[2 * i], request.meshes[2 * i + 1]),
                          "--method"));
    const CrossingAnswer answer =
        find_crossing_triangles(input.surfaces, input.t0,
                                {.culling = *method.culling, .within = request.self || input.t0.size() == 1, .as_paper = method.as_paper});
    if (!request.out.empty())
        if (const auto written = write_file_atomically(request.out, contact_csv(std::array{ContactStep{0, answer.rows}}, false)); !written)
            return report_error(written.error());
    if (!request.stats.empty())
        if (const auto written = write_file_atomically(request.stats, crossing_json(answer, method).dump(2) + "\n"); !written)
            return report_error(written.error());
    for (std::size_t k = 0; k < answer.passes.size(); ++k)
        fmt::print("view {}: {} triangles of {} left\n", k + 1, answer.passes[k].triangles_left, answer.passes[k].triangles);
    for (const std::string& note : answer.notes) fmt::print("note: {}\n", note);
    fmt::print(
        "{} by {}: {} sets, {} triangles of {} left for exact tests; culling {:.2f} ms, tests {:.2f} ms\n{} pairs of triangles cross\n",
        method.name(), answer.culler, answer.colours, answer.left, answer.triangles, answer.cull_ms, answer.narrow_ms, answer.rows.size());
    return kExitFine;
}

int find_contacts(const Request& request) {
    if (const auto usage = check_usage(request); !usage) return report_error(usage.error());
    const auto method = parse_contact_method(request.method);
    if (!method) return report_error(method.error());
    auto input = read_input(request);
    if (!input) return report_error(input.error());
    if (method->image_space) return find_crossings_of(request, *method, *input);
    return Run(request, *method, std::move(*input)).run();
}

} // namespace

Command add_contacts_command(CLI::App& app) {
    const auto request = std::make_shared<Request>();
    CLI::App* command =
        app.add_subcommand("contacts", "Exact vertex-face and edge-edge contacts while vertices move linearly between two frames");
    command->add_option("meshes", request->meshes, "A0 A1 [B0 B1]: start and end frame of one or two meshes");
    command->add_option("--frames", request->frames,
                        "a folder with meta.txt, tris.i32, obj.i32, pos.f64 instead: every step of a sequence");
    command->add_flag("--self", request->self, "with two meshes: each against itself as well (one mesh alone always is)");
    command->add_flag("--coherent", request->coherent,
                      "with --frames: keep from step to step what cannot have changed; the same contacts, in less time");
    command->add_option("--distance", request->distance,
                        "contact means no farther apart than this, in the files' unit; up to 1e-9 of it more may be reported");
    command->add_option("--method", request->method, kMethodWords);
    command->add_option("--threads", request->threads, "threads; the answer does not depend on it")->check(CLI::Range(1u, 256u));
    command->add_option("--out", request->out, "write the contacts to this CSV");
    command->add_option("--stats", request->stats, "write counts and times to this JSON");
    command->add_option("--dump", request->dump, "with --frames: write the hits as 24-byte records");
    return {command, [request] { return find_contacts(*request); }};
}

} // namespace seldinger::engine
