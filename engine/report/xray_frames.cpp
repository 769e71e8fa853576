#include "engine/report/xray_frames.hpp"

#include "engine/effects/contrast/contrast.hpp"
#include "engine/fluoroscopy/film.hpp"
#include "engine/fluoroscopy/grey_png.hpp"
#include "engine/fluoroscopy/matter.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/report/lettered_frame.hpp"
#include "engine/report/output_folder.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <numbers>

namespace trocar::engine {

namespace {

constexpr std::size_t kMostDicomBytes = std::size_t{1} << 30; // of all views' frames in memory
constexpr std::size_t kMostFilmBytes = std::size_t{1} << 26; // likewise: a report is to open at once
constexpr double kDegrees = 180.0 / std::numbers::pi;

nlohmann::ordered_json rows_of(const XrayProjection& projection) {
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (int r = 0; r < 3; ++r) rows.push_back({projection(r, 0), projection(r, 1), projection(r, 2), projection(r, 3)});
    return rows;
}

} // namespace

struct XrayFrames::Camera {
    explicit Camera(const XrayView& view) : scope(view) {}
    Fluoroscope scope;
    XrayProjection first = XrayProjection::Zero();
    std::vector<std::string> files;
    std::vector<GreyFrame> film; // of a display for people, from the first frame on
    std::string film_file;
    DicomSeries series;
};

XrayFrames::XrayFrames(const Scene& scene, const PreparedScene& prepared, std::filesystem::path folder)
    : scene_(scene), prepared_(prepared), folder_(std::move(folder)), patient_(*scene.outputs.fluoroscopy, prepared.model) {
    notices_ = patient_.notices();
    for (const XrayView& view : scene.outputs.fluoroscopy->views) {
        Camera& camera = *cameras_.emplace_back(std::make_unique<Camera>(view));
        camera.first = make_cone_beam(view, find_angles(view, 0.0)).projection();
        camera.series.scene = prepared.model.name;
        camera.series.frame_time = prepared.model.step_s * scene.outputs.fluoroscopy->every;
    }
}

XrayFrames::~XrayFrames() = default;

Result<std::unique_ptr<XrayFrames>> XrayFrames::make(const Scene& scene, const PreparedScene& prepared, std::filesystem::path folder) {
    if (!scene.outputs.fluoroscopy) return std::unique_ptr<XrayFrames>();
    std::unique_ptr<XrayFrames> frames(new XrayFrames(scene, prepared, std::move(folder)));
    if (Result<void> outside = frames->check_sources(); !outside) return outside.error();
    return frames;
}

Result<void> XrayFrames::check_sources() const {
    const State start = make_initial_state(prepared_.model);
    for (std::size_t i = 0; i < cameras_.size(); ++i)
        if (Result<void> outside = patient_.check_source(start, cameras_[i]->scope.view()); !outside)
            return scene_error(scene_, fmt::format("outputs.fluoroscopy.views[{}].sod", i), outside.error().message);
    return {};
}

bool XrayFrames::is_due(const State& state) const noexcept { return state.step % scene_.outputs.fluoroscopy->every == 0; }

void XrayFrames::note(const Result<void>& written) {
    if (!written) failed_.push_back(written.error());
}

void XrayFrames::take(const State& state) {
    const std::filesystem::path place = folder_ / output_name::kFluoro;
    std::error_code failed;
    std::filesystem::create_directories(place, failed);
    if (failed) return note(Error{.code = ErrorCode::CannotWrite, .message = "cannot be made: " + failed.message(), .file = place.string()});
    ++frames_;
    for (const auto& camera : cameras_) take_view(*camera, state);
    const effects::ContrastBalance balance = effects::measure_contrast(prepared_.model, state);
    injected_ = balance.injected, in_vessels_ = balance.in_vessels, washed_out_ = balance.washed_out;
    curve_rows_ += fmt::format("{},{},{},{},{}", state.step, state.time, balance.injected, balance.in_vessels, balance.washed_out);
    for (const Place& target : prepared_.targets) curve_rows_ += fmt::format(",{}", effects::find_iodine(prepared_.model, state, target.position));
    curve_rows_ += '\n';
}

void XrayFrames::take_view(Camera& camera, const State& state) {
    const XrayView& view = camera.scope.view();
    const XrayFrame& now = camera.scope.project(patient_, state);
    const XrayProjection projection = now.beam.projection();
    if (camera.files.empty()) camera.first = projection;
    const std::string stem = fmt::format("{}_{:06}", view.name, state.step);
    const std::filesystem::path place = folder_ / output_name::kFluoro;
    const GreyFrame frame = camera.scope.frame(state.step, state.time);
    note(write_grey_png(place / (stem + ".png"), frame));
    if (view.masks) {
        note(write_grey_png(place / (stem + "_device.png"), camera.scope.device_mask()));
        note(write_grey_png(place / (stem + "_vessel.png"), camera.scope.vessel_mask(patient_, state)));
    }
    if (view.depth) note(write_grey_png(place / (stem + "_depth.png"), camera.scope.depth(patient_, state)));
    camera.files.push_back(fmt::format("{}/{}.png", output_name::kFluoro, stem));
    frame_rows_ += fmt::format("{},{},{},{}.png,{},{}", view.name, state.step, state.time, stem, kDegrees * now.angles.primary, kDegrees * now.angles.secondary);
    const auto tip = state.instruments.empty() ? std::nullopt : trocar::engine::project(projection, state.instruments.front().rod.position.back());
    frame_rows_ += tip ? fmt::format(",{},{}", (*tip)[0], (*tip)[1]) : std::string(",,");
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c) frame_rows_ += fmt::format(",{}", projection(r, c));
    frame_rows_ += '\n';
    if (view.masks)
        for (std::size_t i = 0; i < state.instruments.size(); ++i) {
            const InstrumentModel& instrument = prepared_.model.instruments[i];
            const auto& rod = state.instruments[i].rod;
            for (Index n = fem::first_inserted_node(instrument.rod, rod.insertion); n < rod.position.size(); ++n)
                if (const auto at = trocar::engine::project(projection, rod.position[n]))
                    line_rows_ += fmt::format("{},{},{},{},{},{}\n", view.name, state.step, instrument.name, n, (*at)[0], (*at)[1]);
        }
    if (view.display != XrayDisplay::Linear && film_bytes_ + frame.values.size() <= kMostFilmBytes) {
        film_bytes_ += frame.values.size();
        camera.film.push_back(lettered_frame(frame, now.beam));
    }
    if (!view.dicom) return;
    const std::size_t bytes = frame.values.size() * sizeof(frame.values[0]);
    if (dicom_bytes_ + bytes > kMostDicomBytes) {
        if (dicom_bytes_ <= kMostDicomBytes) notices_.push_back(fmt::format("fluoroscopy: DICOM files end at step {}: their frames fill 1 GiB; every, or fewer pixels, would help", state.step));
        dicom_bytes_ = kMostDicomBytes + 1;
        return;
    }
    dicom_bytes_ += bytes;
    camera.series.angles.push_back(now.angles);
    camera.series.frames.push_back(frame);
}

void XrayFrames::finish() {
    if (frames_ == 0) return;
    const std::filesystem::path place = folder_ / output_name::kFluoro;
    note(write_file_atomically(place / "frames.csv",
                               "view,step,time_s,file,primary_deg,secondary_deg,tip_u,tip_v,p00,p01,p02,p03,p10,p11,p12,p13,p20,p21,p22,p23\n" + frame_rows_));
    if (!line_rows_.empty()) note(write_file_atomically(place / "centrelines.csv", "view,step,instrument,node,u,v\n" + line_rows_));
    if (injected_ > 0.0) {
        std::string head = "step,time_s,injected_kg,in_vessels_kg,washed_out_kg";
        for (std::size_t i = 0; i < scene_.targets.size(); ++i) head += fmt::format(",iodine_{}_kg_m3", scene_.targets[i].name);
        note(write_file_atomically(place / "contrast.csv", head + "\n" + curve_rows_));
    }
    for (const auto& camera : cameras_) {
        if (camera->film.empty()) continue;
        const Result<std::string> bytes = encode_film(camera->film, camera->series.frame_time);
        camera->film_file = fmt::format("{}/{}_film.png", output_name::kFluoro, camera->scope.view().name);
        note(bytes ? write_file_atomically(folder_ / camera->film_file, *bytes) : Result<void>(bytes.error()));
    }
    for (const auto& camera : cameras_) {
        if (camera->series.frames.empty()) continue;
        const Result<std::string> bytes = encode_dicom(camera->scope.view(), camera->series);
        note(bytes ? write_file_atomically(place / (camera->scope.view().name + ".dcm"), *bytes) : Result<void>(bytes.error()));
    }
}

std::string XrayFrames::contrast_curve() const {
    std::string rows = injected_ > 0.0 ? curve_rows_ : std::string();
    std::replace(rows.begin(), rows.end(), ',', ' ');
    return rows;
}

std::vector<XrayFrames::Shown> XrayFrames::shown() const {
    std::vector<Shown> all;
    for (const auto& camera : cameras_)
        if (!camera->files.empty())
            all.push_back({camera->scope.view().name, camera->film_file.empty() ? camera->files.back() : camera->film_file, camera->files.size()});
    return all;
}

nlohmann::ordered_json XrayFrames::views() const {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const auto& camera : cameras_) {
        const XrayView& view = camera->scope.view();
        list.push_back({{"name", view.name},
                        {"projection", rows_of(camera->first)},
                        {"moves", !view.arm.empty()},
                        {"pixels", view.pixels},
                        {"bits", bits_of(view)},
                        {"frames", camera->files.size()},
                        {"last", camera->files.empty() ? std::string() : camera->files.back()}});
    }
    return list;
}

nlohmann::ordered_json XrayFrames::facts() const {
    nlohmann::ordered_json matter = nlohmann::ordered_json::array();
    for (const auto* bodies : {&patient_.bodies(), &patient_.instruments()})
        for (const XrayBody& body : *bodies) {
            matter.push_back({{"name", body.name},
                              {"matter", std::string(coefficient_of(body.matter).name)},
                              {"attenuation_per_m", body.attenuation},
                              {"closed", body.shell == 0.0}});
            if (body.wall != 0.0) matter.back()["wall_attenuation_per_m"] = body.wall;
        }
    nlohmann::ordered_json facts{{"energy_kev", kXrayEnergy}, {"bodies", std::move(matter)}};
    if (injected_ > 0.0)
        facts["iodine_kg"] = {{"injected", injected_}, {"in_vessels", in_vessels_}, {"washed_out", washed_out_}};
    return facts;
}

} // namespace trocar::engine
