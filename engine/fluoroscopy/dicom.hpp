// Frames of one C-arm as a DICOM X-ray angiographic image (PS3.3 A.14), multi-frame, explicit VR little endian, uncompressed.
#pragma once

#include "engine/fluoroscopy/detector.hpp"

#include "base/result.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

/// What a file says of its frames.
struct DicomSeries {
    std::string scene; // patient and study are named by it
    double frame_time = 0.1;          // s, between frames
    std::vector<ArmAngles> angles;    // [frames]
    std::vector<GreyFrame> frames;    // all of one size
};

/// fails     BadValue: no frames, or more than a file can hold (4 GiB)
[[nodiscard]] Result<std::string> encode_dicom(const XrayView& view, const DicomSeries& series);

/// The geometry that an XA file says: name, angles, distances, pixels and the detector's size.
/// fails     BadSyntax: no DICOM file of explicit VR little endian, or one without these
[[nodiscard]] Result<XrayView> read_dicom_view(std::string_view bytes, const std::string& file);

} // namespace trocar::engine
