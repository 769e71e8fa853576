// `contacts`: the exact contacts of one step between two frames of one or two meshes, or of every step of a sequence of frames.
#include "collision/search/coherent_search.hpp"
#include "collision/search/contact_search.hpp"
#include "engine/cli/commands.hpp"
#include "engine/cli/contact_method.hpp"
#include "engine/cli/contacts_input.hpp"
#include "engine/cli/contacts_report.hpp"
#include "engine/cli/image_space_contacts.hpp"
#include "engine/cli/progress.hpp"
#include "engine/experiments/coherence_comparison.hpp"
#include "engine/experiments/contact_record.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/io/contact_rows.hpp"
#include "engine/io/frames.hpp"
#include "engine/time/clock.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <memory>

namespace trocar::engine {

namespace {

using collision::ContactSearch;
using collision::SearchContact;
using collision::SurfaceMotion;
using collision::SurfaceTopology;

/// At a distance, pairs up to this part of it farther apart may be reported as well.
constexpr double kDistanceTolerance = 1e-9;
/// Pairs of features that `brute` decides at most.
constexpr double kMostBrutePairs = 3e7;

double pair_count(const ContactsInput& input, const collision::SearchOptions& options) {
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

class Run {
public:
    Run(const ContactsRequest& request, const ContactMethod& method, ContactsInput input)
        : request_(request), method_(method), input_(std::move(input)) {
        options_.within = request.self || input_.is_sequence() || input_.surfaces.size() == 1;
        options_.distance = request.distance;
        options_.tolerance = kDistanceTolerance * request.distance;
        options_.tree = method.tree;
        options_.simd = method.simd;
        options_.all_pairs = method.brute;
        options_.threads = request.threads;
    }

    int compare() {
        if (const auto usage = check_coherent(); !usage) return report_error(usage.error());
        const auto compared = compare_coherence(
            input_.sequence.frame_count - 1, [&](std::size_t k) { return motions(k); }, coherent_options());
        if (!compared) return report_error(bad_usage(compared.error().message, "--coherent"));
        WrittenOutputs outputs;
        if (!request_.stats.empty()) outputs.note(write_file_atomically(request_.stats, compared->json().dump(2) + "\n"));
        fmt::print("{}\n", compared->text());
        return outputs.all_there() && !compared->same ? kExitDiffers : outputs.tell({});
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
        finish_report();
        const WrittenOutputs outputs = write();
        fmt::print("{}", contacts_report_text(report_));
        return outputs.tell({});
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
        report_.build_ms = watch.lap_ms();
        return {};
    }

    Result<void> check_coherent() const {
        if (method_.culling || method_.brute)
            return bad_usage(fmt::format("keeps what the hierarchy finds; it does not go with --method {}", request_.method), "--coherent");
        return {};
    }

    collision::CoherentOptions coherent_options() const {
        collision::CoherentOptions options;
        static_cast<collision::PairOptions&>(options) = options_;
        options.between = options_.between;
        options.within = options_.within;
        options.tree = options_.tree;
        return options;
    }

    Result<void> build_coherent(std::span<const SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions) {
        if (auto usage = check_coherent(); !usage) return usage;
        coherent_ = std::make_unique<collision::CoherentSearch>();
        auto built = coherent_->build(surfaces, positions, coherent_options());
        if (!built) return bad_usage(built.error().message, "--coherent");
        return {};
    }

    Result<void> step_coherently(std::span<const SurfaceMotion> motions, ContactsStepRow& row, StopWatch& watch) {
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
    void cull(std::span<const SurfaceMotion> step, ContactsStepRow& row) {
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

    void step_anew(std::span<const SurfaceMotion> motions, ContactsStepRow& row, StopWatch& watch) {
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
        ContactsStepRow row;
        row.frame = k;
        if (!coherent_)
            step_anew(moved, row, watch);
        else if (auto done = step_coherently(moved, row, watch); !done)
            return done;
        report_.rows.push_back(row);
        if (!request_.out.empty()) {
            ContactStep contacts{k, {}};
            for (const SearchContact& found : found_) contacts.rows.push_back(record_of(found, input_.sequence.objects));
            contacts_.push_back(std::move(contacts));
        }
        if (request_.dump.empty()) return {};
        for (const SearchContact& found : found_)
            hits_.push_back({static_cast<std::int32_t>(k), found.contact.origin == ContactOrigin::ExactVF ? 0 : 1,
                             static_cast<std::int32_t>(found.id_a), static_cast<std::int32_t>(found.id_b), found.contact.time});
        return {};
    }

    void finish_report() {
        report_.method = method_.name() + (coherent_ ? "-coherent" : "");
        report_.distance = request_.distance;
        report_.threads = request_.threads;
        report_.sequence = input_.is_sequence();
        report_.coherent = coherent_ != nullptr;
        for (const collision::DopTree& tree : search_.trees()) report_.memory += tree.memory();
        if (coherent_) report_.memory = coherent_->memory();
        if (culled_) report_.culled = ContactsReport::Culled{culled_->colours(), culled_->backend(), culled_->notes()};
    }

    WrittenOutputs write() const {
        WrittenOutputs outputs;
        if (!request_.out.empty()) outputs.note(write_file_atomically(request_.out, contact_csv(contacts_, input_.is_sequence())));
        if (!request_.dump.empty()) outputs.note(write_hits(request_.dump, hits_));
        if (!request_.stats.empty()) outputs.note(write_file_atomically(request_.stats, contacts_report_json(report_).dump(2) + "\n"));
        return outputs;
    }

    const ContactsRequest& request_;
    const ContactMethod& method_;
    ContactsInput input_;
    collision::SearchOptions options_;
    ContactSearch search_;
    std::unique_ptr<CulledSearch> culled_;                // by chromatic sets, if the method says so
    std::unique_ptr<collision::CoherentSearch> coherent_; // instead of search_, with --coherent
    ContactsReport report_;
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
                                  {"patches", pass.patches},
                                  {"largest_patch", pass.largest_patch},
                                  {"questions", pass.questions}});
    return json;
}

/// Triangles that cross, of static meshes.
int find_crossings_of(const ContactsRequest& request, const ContactMethod& method, const ContactsInput& input) {
    if (input.is_sequence() || request.distance > 0.0)
        return report_error(bad_usage("image-space takes one or two static meshes, without --frames and --distance", "--method"));
    for (std::size_t i = 0; i < input.t0.size(); ++i)
        if (input.t0[i] != input.t1[i])
            return report_error(
                bad_usage(fmt::format("{} and {} differ; image-space takes static meshes: name the same file twice",
                                      request.meshes[2 * i], request.meshes[2 * i + 1]),
                          "--method"));
    const CrossingAnswer answer = find_crossing_triangles(input.surfaces, input.t0,
                                                          {.culling = *method.culling,
                                                           .within = request.self || input.t0.size() == 1,
                                                           .plan = {.patches = method.patches},
                                                           .as_paper = method.as_paper});
    WrittenOutputs outputs;
    if (!request.out.empty()) outputs.note(write_file_atomically(request.out, contact_csv(std::array{ContactStep{0, answer.rows}}, false)));
    if (!request.stats.empty()) outputs.note(write_file_atomically(request.stats, crossing_json(answer, method).dump(2) + "\n"));
    for (std::size_t k = 0; k < answer.passes.size(); ++k)
        fmt::print("view {}{}: {} triangles of {} left\n", k + 1,
                   answer.passes[k].patches > 0
                       ? fmt::format(", {} patches of up to {} triangles", answer.passes[k].patches, answer.passes[k].largest_patch)
                       : "",
                   answer.passes[k].triangles_left, answer.passes[k].triangles);
    for (const std::string& note : answer.notes) fmt::print("note: {}\n", note);
    fmt::print(
        "{} by {}: {} sets, {} triangles of {} left for exact tests; culling {:.2f} ms, tests {:.2f} ms\n{} pairs of triangles cross\n",
        method.name(), answer.culler, answer.colours, answer.left, answer.triangles, answer.cull_ms, answer.narrow_ms, answer.rows.size());
    return outputs.tell({});
}

int find_contacts(const ContactsRequest& request) {
    if (const auto usage = check_contacts_usage(request); !usage) return report_error(usage.error());
    const auto method = parse_contact_method(request.method);
    if (!method) return report_error(method.error());
    auto input = read_contacts_input(request);
    if (!input) return report_error(input.error());
    if (method->image_space) return find_crossings_of(request, *method, *input);
    Run run(request, *method, std::move(*input));
    return request.compare ? run.compare() : run.run();
}

} // namespace

Command add_contacts_command(CLI::App& app) {
    const auto request = std::make_shared<ContactsRequest>();
    CLI::App* command =
        app.add_subcommand("contacts", "Exact vertex-face and edge-edge contacts while vertices move linearly between two frames");
    command->add_option("meshes", request->meshes, "A0 A1 [B0 B1]: start and end frame of one or two meshes");
    command->add_option("--frames", request->frames,
                        "a folder with meta.txt, tris.i32, obj.i32, pos.f64 instead: every step of a sequence");
    command->add_flag("--self", request->self, "with two meshes: each against itself as well (one mesh alone always is)");
    command->add_flag("--coherent", request->coherent,
                      "with --frames: keep from step to step what cannot have changed; the same contacts, in less time");
    command->add_flag("--compare", request->compare,
                      "with --coherent: every step without it as well, and the share of the time that is left");
    command->add_option("--distance", request->distance,
                        "contact means no farther apart than this, in the files' unit; up to 1e-9 of it more may be reported");
    command->add_option("--method", request->method, kMethodWords);
    command->add_option("--threads", request->threads, "threads; the answer does not depend on it")->check(CLI::Range(1u, 256u));
    command->add_option("--out", request->out, "write the contacts to this CSV");
    command->add_option("--stats", request->stats, "write counts and times to this JSON");
    command->add_option("--dump", request->dump, "with --frames: write the hits as 24-byte records");
    return {command, [request] { return find_contacts(*request); }};
}

} // namespace trocar::engine
