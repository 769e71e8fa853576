// Keys of "outputs.fluoroscopy": X-ray frames of a C-arm.
#pragma once

#include "engine/scene/described.hpp"
#include "engine/scene/reader.hpp"
#include "engine/scene/scene.hpp"

namespace trocar::engine {

/// Of a detector; a frame's sums take 8 bytes each.
inline constexpr double kMostXrayEdge = 8192;
inline constexpr std::size_t kMostXrayPixels = std::size_t{1} << 24;

/// A pair of numbers, x and y.
[[nodiscard]] inline FieldSpec pair_field(std::string_view key, Dimension dimension, Range range, std::array<std::string_view, 2> names,
                                          std::string_view doc) {
    ValueSpec value;
    value.kind = ValueKind::Vector;
    value.columns = {{names[0], dimension, range}, {names[1], dimension, range}};
    return value_field(key, std::move(value), doc);
}

struct XrayViewKeys {
    using Struct = XrayView;
    static auto of(auto& s) {
        const auto angle = [](std::string_view key, std::string_view doc) {
            return value_field(key, any_value({text_field("", "").value, number_field("", Dimension::Angle, {}, "").value}), doc);
        };
        return described(
            {"xray_view", "A C-arm. At 0/0 the beam runs from behind the patient to the front, and the picture shows the patient's right on its left."},
            key(s.name, text_field("name", "Of the view: letters, digits, - and _. Files begin with it.").required()),
            custom_key(angle("primary", "Primary angle, as in \"LAO 30 deg\", \"RAO 20 deg\" or \"30 deg\" (+ is LAO: the detector goes to the "
                                        "patient's left); a number is in the scene's unit. 0 when absent, at most 180 deg."),
                       read_primary, s.primary),
            custom_key(angle("secondary", "Secondary angle, as in \"CRA 20 deg\", \"CAU 20 deg\" or \"-20 deg\" (+ is CRA: the detector goes to the "
                                          "patient's head). 0 when absent, at most 90 deg."),
                       read_secondary, s.secondary),
            custom_key(value_field("arm",
                                   rows_value({{"time", Dimension::Time, between(0.0, 1e6)},
                                               {"primary", Dimension::Angle, between(-3.1415926536, 3.1415926536)},
                                               {"secondary", Dimension::Angle, between(-1.5707963268, 1.5707963268)}},
                                              1, 100000),
                                   "The arm moves: rows of time, primary and secondary angle in the scene's unit, linear between them."),
                       read_arm, s.arm),
            key(s.isocentre, vector_field("isocentre", Dimension::Length, coordinate(), "Round which the arm turns.")),
            key(s.table, vector_field("table", Dimension::Length, coordinate(), "By how much the table has moved the patient.")),
            key(s.sid, number_field("sid", Dimension::Length, {0.01, 10.0, false, 0.85, 1.3, "C-arms have 0.9 to 1.2 m"},
                                    "From the source to the detector (DICOM 0018,1110).")),
            key(s.sod, number_field("sod", Dimension::Length, {0.005, 10.0, false, 0.5, 0.9, "C-arms have 0.6 to 0.8 m"},
                                    "From the source to the isocentre (DICOM 0018,1111).")),
            custom_key(pair_field("detector", Dimension::Length, between(1e-4, 2.0), {"width", "height"},
                                  "Width and height of the detector; 300 mm each when absent."),
                       read_detector, s.detector),
            custom_key(pair_field("pixels", Dimension::None, between(1, kMostXrayEdge), {"columns", "rows"},
                                  "Columns and rows; 512 each when absent, 2^24 in all at most."),
                       read_xray_pixels, s.pixels),
            key(s.display, choice_field("display", {"linear", "log", "subtraction", "roadmap"},
                                        "Grey values: transmission (full scale is the open beam), its logarithm within a window, what is "
                                        "denser than in the mask frame, or the logarithm with the largest contrast so far over it.")),
            custom_key(pair_field("window", Dimension::None, between(-100.0, 100.0), {"white", "black"},
                                  "Attenuations -ln(I/I0) that are white and black, unless the display is linear; the first frame's own when absent."),
                       read_window, s.window),
            key(s.mask, number_field("mask", Dimension::Time, between(0.0, 1e6), "When the frame is taken that is subtracted from later ones.")),
            key(s.noise, flag_field("noise", "Photons are counted (Poisson).")),
            key(s.photons, number_field("photons", Dimension::None, between(1.0, 1e9), "The dose: photons of a pixel in the open beam.")),
            key(s.blur, number_field("blur", Dimension::Length, between(0.0, 0.01), "Standard deviation of the detector's point spread.")),
            key(s.scatter, number_field("scatter", Dimension::None, between(0.0, 0.95), "Share of the signal that is scattered radiation.")),
            key(s.scatter_width, number_field("scatter_width", Dimension::Length, between(1e-4, 1.0), "Standard deviation of its spread on the detector.")),
            key(s.seed, count_field("seed", 0, 4294967295.0, "Of the noise.")),
            custom_key(count_field("bits", 8, 16, "Of a pixel: 8 or 16; 16 of a linear display and 8 otherwise when absent."), read_bits, s.bits),
            key(s.masks, flag_field("masks", "Beside each frame a picture of where instruments are (_device) and one of vessels (_vessel).")),
            key(s.depth, flag_field("depth", "Beside each frame a 16-bit picture of where its rays first meet a body (_depth), in 1/65535 of the source-detector distance; 0: nowhere.")),
            key(s.dicom, flag_field("dicom", "All frames of the view as a DICOM XA multi-frame file, NAME.dcm.")));
    }
};
static_assert(describes_all<XrayViewKeys>);

/// As XrayMatter has them.
inline std::vector<std::string_view> matter_words() { return {"tissue", "blood", "bone", "nitinol", "steel"}; }

struct FluoroscopyKeys {
    using Struct = FluoroscopySpec;
    static auto of(auto& s) {
        return described(
            {"fluoroscopy_frames", "Frames of one C-arm, of a biplane system, or of more."},
            key(s.every, count_field("every", 1, 1e9, "Steps between frames; the first is of the start.")),
            custom_key(value_field("views", list_value(object_value(table_of<XrayViewKeys>()), 1), "The C-arms.").required(), read_views, s.views),
            custom_key(map_field("matter", choice_value(matter_words()),
                                 "What bodies and instruments are made of for X-rays, by their names. When absent: vessels hold blood, "
                                 "instruments are nitinol, other bodies soft tissue."),
                       read_matter, s.matter),
            key(s.shell, number_field("shell", Dimension::Length, between(1e-6, 0.1), "Thickness of surfaces that are not closed: thin shells.")),
            key(s.wall, number_field("wall", Dimension::Length, between(0.0, 0.01), "Thickness of vessels' walls, outside of their surfaces; 0: walls attenuate as "
                                                                                    "what the vessel lies in.")),
            key(s.wall_matter, choice_field("wall_matter", matter_words(), "What vessels' walls are made of: tissue, bone where they are calcified, a metal where they "
                                                                         "are stented.")));
    }
};
static_assert(describes_all<FluoroscopyKeys>);

} // namespace trocar::engine
