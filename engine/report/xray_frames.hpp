// X-ray frames of a run, as "outputs.fluoroscopy" asks for them: pictures in the folder fluoro, a table of where the arm and the tip
// stood, what contrast came to the targets.
#pragma once

#include "engine/fluoroscopy/dicom.hpp"
#include "engine/fluoroscopy/fluoroscope.hpp"
#include "engine/report/missing.hpp"

#include <nlohmann/json_fwd.hpp>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace trocar::engine {

class XrayFrames {
public:
    /// Nothing where the scene asks for none.
    /// scene, prepared   outlive it
    /// fails     BadValue: a source stands inside a closed body
    [[nodiscard]] static Result<std::unique_ptr<XrayFrames>> make(const Scene& scene, const PreparedScene& prepared, std::filesystem::path folder);

    [[nodiscard]] bool is_due(const State& state) const noexcept;
    /// Writes the frames of every view. What cannot be written is in failed(), and the others are.
    void take(const State& state);
    /// Writes the tables and DICOM files.
    void finish();

    [[nodiscard]] const std::vector<Error>& failed() const noexcept { return failed_; }
    [[nodiscard]] const std::vector<std::string>& notices() const noexcept { return notices_; }
    /// Of each view the picture for the report, in the output folder: its film, or its last frame; and how many frames it has.
    struct Shown {
        std::string title, file;
        std::size_t frames = 0;
    };
    [[nodiscard]] std::vector<Shown> shown() const;
    /// "views" of summary.json: name, projection (3 x 4, of the first frame), frames and how they were made.
    [[nodiscard]] nlohmann::ordered_json views() const;
    /// "fluoroscopy" of summary.json: the photons' energy, what attenuates by how much, contrast's balance.
    [[nodiscard]] nlohmann::ordered_json facts() const;
    /// Contrast at each frame, as contrast.csv has it: a row for each, blanks between step, time [s], injected, in the vessels, washed out [kg of iodine],
    /// then at every target [kg/m^3]. Empty: none was injected.
    [[nodiscard]] std::string contrast_curve() const;

private:
    struct Camera; // a view and what its frames have come to
    XrayFrames(const Scene& scene, const PreparedScene& prepared, std::filesystem::path folder);
    [[nodiscard]] Result<void> check_sources() const;
    void note(const Result<void>& written);
    void take_view(Camera& camera, const State& state);

    const Scene& scene_;
    const PreparedScene& prepared_;
    std::filesystem::path folder_;
    XrayPatient patient_;
    std::vector<std::unique_ptr<Camera>> cameras_;
    std::string frame_rows_, curve_rows_, line_rows_;
    std::size_t dicom_bytes_ = 0, film_bytes_ = 0;
    std::vector<Error> failed_;
    std::vector<std::string> notices_;
    double injected_ = 0.0, in_vessels_ = 0.0, washed_out_ = 0.0; // kg of iodine at the last frame
    std::size_t frames_ = 0;

public:
    ~XrayFrames();
};

} // namespace trocar::engine
