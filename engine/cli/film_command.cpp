// `film`: a scene as the angiography suite shows it, one animated PNG.
#include "engine/cli/commands.hpp"
#include "engine/cli/progress.hpp"
#include "engine/cli/set_option.hpp"
#include "engine/cli/taken_files.hpp"
#include "engine/fluoroscopy/dicom.hpp"
#include "engine/fluoroscopy/film.hpp"
#include "engine/fluoroscopy/fluoroscope.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/report/lettered_frame.hpp"
#include "engine/scene/describe_fluoroscopy.hpp"
#include "engine/step/simulator.hpp"
#include "engine/time/interrupt.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>
#include <vector>

namespace trocar::engine {

namespace {

constexpr std::size_t kMostFilmBytes = std::size_t{1} << 30; // of frames in memory
constexpr std::array<unsigned, 2> kFilmPixels{256, 256};     // of a scene that has no view of its own

struct FilmOptions {
    std::filesystem::path scene, out = "film.png";
    std::string view;             // by name; empty: the scene's first
    std::filesystem::path like;   // a DICOM XA file: its angles, distances and detector in place of the view's
    std::int64_t steps = -1;
    unsigned every = 0; // steps; 0: as the scene says, or 10
    SceneSettings settings;
};

/// The view that is filmed: of the scene, or one of the whole patient from the front.
Result<FluoroscopySpec> choose_view(const FilmOptions& options, const Scene& scene, const SceneModel& model) {
    FluoroscopySpec spec = scene.outputs.fluoroscopy.value_or(FluoroscopySpec{});
    if (options.every > 0) spec.every = options.every;
    if (spec.views.empty() && options.view.empty()) {
        spec.views = {XrayPatient::whole_view(model, make_initial_state(model), kFilmPixels)};
        spec.views.front().display = XrayDisplay::Log;
        return spec;
    }
    std::string known;
    for (const XrayView& view : spec.views) {
        if (options.view.empty() || view.name == options.view) {
            spec.views = {XrayView(view)};
            return spec;
        }
        known += (known.empty() ? "" : ", ") + view.name;
    }
    return Error{.code = ErrorCode::BadUsage,
                 .message = fmt::format("the scene has no view \"{}\"; it has {}", options.view, known.empty() ? "none" : known),
                 .key = "--view"};
}

/// As the file's C-arm stood, round the view's isocentre.
Result<void> stand_like(const std::filesystem::path& file, XrayView& view) {
    const Result<std::string> bytes = read_file_bytes(file);
    if (!bytes) return bytes.error();
    const Result<XrayView> read = read_dicom_view(*bytes, file.string());
    if (!read) return read.error();
    if (read->pixel_count() > kMostXrayPixels)
        return Error{.code = ErrorCode::BadValue,
                     .message = fmt::format("has {} x {} pixels; expected {} in all at most", read->pixels[0], read->pixels[1], kMostXrayPixels),
                     .file = file.string()};
    view.primary = read->primary, view.secondary = read->secondary, view.sid = read->sid, view.sod = read->sod;
    view.detector = read->detector, view.pixels = read->pixels;
    view.arm.clear();
    return {};
}

int film(const FilmOptions& options) {
    if (const auto fits = check_place(options.out, "--out"); !fits) return report_error(fits.error());
    const Result<Scene> scene = read_set_scene(options.scene, options.settings);
    if (!scene.ok()) return report_error(scene.error());
    std::vector<std::filesystem::path> reads = files_of(*scene);
    if (!options.like.empty()) reads.push_back(options.like);
    if (const auto fine = check_not_taken(options.out, reads, "--out"); !fine) return report_error(fine.error());
    ProgressLine progress(true);
    const auto prepared = make_prepared_scene(*scene, [&](const std::string& what) { progress.show("preparing " + what); });
    progress.clear();
    if (!prepared.ok()) return report_error(prepared.error());
    Result<FluoroscopySpec> spec = choose_view(options, *scene, prepared->model);
    if (!spec.ok()) return report_error(spec.error());
    if (!options.like.empty())
        if (const auto stands = stand_like(options.like, spec->views.front()); !stands) return report_error(stands.error());
    XrayPatient patient(*spec, prepared->model);
    Fluoroscope scope(spec->views.front());
    Simulator simulator(prepared->model);
    if (const auto outside = patient.check_source(simulator.state(), spec->views.front()); !outside) {
        Error error = outside.error();
        error.file = options.scene.string();
        return report_error(error);
    }
    const std::uint64_t steps = options.steps >= 0 ? static_cast<std::uint64_t>(options.steps) : prepared->model.step_count;
    const std::size_t bytes = (steps / spec->every + 1) * spec->views.front().pixel_count() * sizeof(std::uint16_t);
    if (bytes > kMostFilmBytes)
        return report_error({ErrorCode::BadValue, fmt::format("{} frames of {} x {} pixels fill {:.1f} GiB; expected 1 GiB at most: fewer pixels, or a larger --every",
                                                              steps / spec->every + 1, spec->views.front().pixels[0], spec->views.front().pixels[1],
                                                              static_cast<double>(bytes) / (1u << 30))});
    const InterruptHold hold(InterruptHold::Then::OwnerEnds); // frames that were taken become the film
    std::vector<GreyFrame> frames;
    const auto take = [&](const State& state) {
        const ConeBeam& beam = scope.project(patient, state).beam;
        frames.push_back(lettered_frame(scope.frame(state.step, state.time), beam));
    };
    take(simulator.state());
    int code = kExitFine;
    for (std::uint64_t k = 0; k < steps && code == kExitFine; ++k) {
        if (interrupt_requested()) {
            code = kExitInterrupted;
            break;
        }
        const StepReport& report = simulator.step();
        progress.show_step(k + 1, steps, report, simulator.budget());
        if (!report.finite) code = kExitNotFinite;
        if (report.finite && report.step % spec->every == 0) take(simulator.state());
    }
    progress.clear();
    const Result<std::string> bytes_of_film = encode_film(frames, prepared->model.step_s * spec->every);
    if (!bytes_of_film.ok()) return report_error(bytes_of_film.error());
    if (const auto written = write_file_atomically(options.out, *bytes_of_film); !written) return report_error(written.error());
    fmt::print("{} frames of {} x {} pixels, every {} steps: {}\n", frames.size(), frames.front().width, frames.front().height, spec->every, options.out.string());
    for (const std::string& notice : patient.notices()) fmt::print("notice: {}\n", notice);
    if (code == kExitNotFinite) report_error({ErrorCode::NotFinite, simulator.report().failure});
    return code;
}

} // namespace

Command add_film_command(CLI::App& app) {
    const auto options = std::make_shared<FilmOptions>();
    CLI::App* command = app.add_subcommand("film", "Run a scene and show it as the C-arm does: one animated PNG");
    command->add_option("scene", options->scene, "scene file (JSON)")->required();
    command->add_option("--out", options->out, "the film; film.png where none is given");
    command->add_option("--view", options->view, "of outputs.fluoroscopy, by its name; the first where none is given");
    command->add_option("--like", options->like, "a DICOM XA file: its angles, distances and detector instead of the view's");
    command->add_option("-n,--steps", options->steps, "steps to take instead of the scene's duration")->check(CLI::Range(std::int64_t{0}, std::int64_t{1000000000}));
    command->add_option("--every", options->every, "steps between frames, instead of the scene's")->check(CLI::Range(1u, 1000000000u));
    add_set_options(*command, options->settings);
    return {command, [options] { return film(*options); }};
}

} // namespace trocar::engine
