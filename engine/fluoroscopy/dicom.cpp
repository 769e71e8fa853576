#include "engine/fluoroscopy/dicom.hpp"

#include "engine/scene/patient_sides.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>

namespace trocar::engine {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr const char* kXaClass = "1.2.840.10008.5.1.4.1.1.12.1";
constexpr const char* kExplicitLittleEndian = "1.2.840.10008.1.2.1";

std::uint64_t hash_of(std::string_view text, std::uint64_t start) noexcept { // FNV-1a
    for (const char c : text) start = (start ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    return start;
}
/// Under the root for numbers that need no registration (2.25).
std::string uid(std::string_view what, std::string_view of) {
    return fmt::format("2.25.{}{:020}", hash_of(what, hash_of(of, 0xcbf29ce484222325u)) | 1u, hash_of(of, hash_of(what, 0x84222325cbf29ce4u)));
}

void put(std::string& out, std::uint64_t value, int bytes) {
    for (int k = 0; k < bytes; ++k) out.push_back(static_cast<char>(value >> (8 * k)));
}

/// Elements in ascending order, as a file has them.
class Elements {
public:
    void text(std::uint32_t tag, const char* vr, std::string value) {
        if (value.size() % 2 != 0) value.push_back(std::string_view(vr) == "UI" ? '\0' : ' ');
        head(tag, vr);
        put(bytes_, value.size(), 2);
        bytes_ += value;
    }
    void number(std::uint32_t tag, double value) { text(tag, "DS", decimal(value)); }
    void shorts(std::uint32_t tag, const char* vr, std::initializer_list<std::uint16_t> values) {
        head(tag, vr);
        put(bytes_, 2 * values.size(), 2);
        for (const std::uint16_t v : values) put(bytes_, v, 2);
    }
    /// A long form: OB, OW.
    void data(std::uint32_t tag, const char* vr, std::string_view value) {
        head(tag, vr);
        put(bytes_, 0, 2);
        put(bytes_, value.size() + value.size() % 2, 4);
        bytes_ += value;
        if (value.size() % 2 != 0) bytes_.push_back('\0');
    }
    [[nodiscard]] std::string& bytes() noexcept { return bytes_; }
    /// At most 16 characters.
    [[nodiscard]] static std::string decimal(double value) { return fmt::format("{:.10g}", std::abs(value) < 1e-9 ? 0.0 : value).substr(0, 16); }

private:
    void head(std::uint32_t tag, const char* vr) {
        put(bytes_, tag >> 16, 2), put(bytes_, tag & 0xffff, 2);
        bytes_ += std::string_view(vr, 2);
    }
    std::string bytes_;
};

/// Letters that any character set has.
std::string plain(std::string text, std::size_t most) {
    for (char& c : text)
        if (c < ' ' || c > '~' || c == '\\' || c == '^' || c == '=') c = '_';
    return text.substr(0, most);
}

std::string pixel_bytes(const DicomSeries& series, unsigned bits) {
    std::string data;
    data.reserve(series.frames.size() * series.frames.front().values.size() * bits / 8);
    for (const GreyFrame& frame : series.frames)
        for (const std::uint16_t value : frame.values) put(data, value, static_cast<int>(bits / 8));
    return data;
}

std::string increments(const DicomSeries& series, double ArmAngles::* angle) {
    std::string all; // of a frame against the one before it; the first has 0
    for (std::size_t k = 0; k < series.angles.size(); ++k)
        all += (k > 0 ? "\\" : "") + Elements::decimal(k > 0 ? (series.angles[k].*angle - series.angles[k - 1].*angle) / kDegree : 0.0);
    return all;
}

} // namespace

Result<std::string> encode_dicom(const XrayView& view, const DicomSeries& series) {
    if (series.frames.empty() || series.frames.size() != series.angles.size())
        return Error{ErrorCode::BadValue, "a DICOM file has one frame at least, and angles for each"};
    const unsigned bits = series.frames.front().bits;
    const std::size_t size = series.frames.size() * view.pixel_count() * (bits / 8);
    if (size > 0xfffffff0u) return Error{ErrorCode::BadValue, fmt::format("{} bytes of frames do not fit in a DICOM file, which holds 4 GiB", size)};
    const std::string own = series.scene + "/" + view.name, instance = uid("instance", own);
    const bool moves = std::any_of(series.angles.begin(), series.angles.end(), [&](const ArmAngles& a) {
        return a.primary != series.angles.front().primary || a.secondary != series.angles.front().secondary;
    });
    Elements meta;
    meta.data(0x00020001, "OB", std::string_view("\0\1", 2));
    meta.text(0x00020002, "UI", kXaClass);
    meta.text(0x00020003, "UI", instance);
    meta.text(0x00020010, "UI", kExplicitLittleEndian);
    meta.text(0x00020012, "UI", uid("implementation", "trocar"));
    Elements set;
    set.text(0x00080008, "CS", "ORIGINAL\\PRIMARY\\SINGLE PLANE");
    set.text(0x00080016, "UI", kXaClass);
    set.text(0x00080018, "UI", instance);
    for (const std::uint32_t date : {0x00080020u, 0x00080023u}) set.text(date, "DA", "");
    set.text(0x00080030, "TM", "");
    set.text(0x00080033, "TM", "");
    set.text(0x00080050, "SH", "");
    set.text(0x00080060, "CS", "XA");
    set.text(0x00080070, "LO", "Trocar (simulated)");
    set.text(0x00080090, "PN", "");
    set.text(0x0008103e, "LO", view.name);
    set.text(0x00100010, "PN", plain(series.scene, 60));
    set.text(0x00100020, "LO", plain(series.scene, 60));
    set.text(0x00100030, "DA", "");
    set.text(0x00100040, "CS", "");
    set.text(0x00180060, "DS", "");
    set.number(0x00181063, 1e3 * series.frame_time);
    set.number(0x00181110, 1e3 * view.sid);
    set.number(0x00181111, 1e3 * view.sod);
    set.text(0x00181155, "CS", "SC");
    set.text(0x00181164, "DS",
             Elements::decimal(1e3 * view.detector[1] / view.pixels[1]) + "\\" + Elements::decimal(1e3 * view.detector[0] / view.pixels[0]));
    set.text(0x00181500, "CS", moves ? "DYNAMIC" : "STATIC");
    set.number(0x00181510, series.angles.front().primary / kDegree);
    set.number(0x00181511, series.angles.front().secondary / kDegree);
    if (moves) {
        const std::string primary = increments(series, &ArmAngles::primary), secondary = increments(series, &ArmAngles::secondary);
        if (std::max(primary.size(), secondary.size()) < 0xfffe) { // what a short value holds
            set.text(0x00181520, "DS", primary);
            set.text(0x00181521, "DS", secondary);
        }
    }
    set.text(0x0020000d, "UI", uid("study", series.scene));
    set.text(0x0020000e, "UI", uid("series", own));
    set.text(0x00200010, "SH", "1");
    set.text(0x00200011, "IS", "1");
    set.text(0x00200013, "IS", "1");
    const ConeBeam beam = make_cone_beam(view, series.angles.front()); // of a moving arm: of the first frame
    set.text(0x00200020, "CS", side_letters(beam.right) + "\\" + side_letters(beam.down));
    set.shorts(0x00280002, "US", {1});
    set.text(0x00280004, "CS", "MONOCHROME2");
    set.text(0x00280008, "IS", std::to_string(series.frames.size()));
    set.shorts(0x00280009, "AT", {0x0018, 0x1063});
    set.shorts(0x00280010, "US", {static_cast<std::uint16_t>(view.pixels[1])});
    set.shorts(0x00280011, "US", {static_cast<std::uint16_t>(view.pixels[0])});
    set.shorts(0x00280100, "US", {static_cast<std::uint16_t>(bits)});
    set.shorts(0x00280101, "US", {static_cast<std::uint16_t>(bits)});
    set.shorts(0x00280102, "US", {static_cast<std::uint16_t>(bits - 1)});
    set.shorts(0x00280103, "US", {0});
    set.text(0x00281040, "CS", view.display == XrayDisplay::Linear ? "LIN" : "LOG");
    set.data(0x7fe00010, bits == 16 ? "OW" : "OB", pixel_bytes(series, bits));

    std::string file(128, '\0');
    file += "DICM";
    put(file, 0x0002, 2), put(file, 0x0000, 2);
    file += "UL";
    put(file, 4, 2), put(file, meta.bytes().size(), 4);
    file += meta.bytes();
    file += set.bytes();
    return file;
}

namespace {

/// Values of the data set's own elements, up to the pixels; sequences are passed over.
class DicomScan {
public:
    explicit DicomScan(std::string_view bytes) : bytes_(bytes) {}

    /// nothing where the file is damaged
    [[nodiscard]] std::optional<std::map<std::uint32_t, std::string>> run() {
        if (bytes_.size() < 132 || bytes_.substr(128, 4) != "DICM") return std::nullopt;
        std::map<std::uint32_t, std::string> found;
        std::size_t at = 132;
        while (at + 8 <= bytes_.size()) {
            const auto tag = static_cast<std::uint32_t>(number(at, 2) << 16 | number(at + 2, 2));
            const std::string_view vr = bytes_.substr(at + 4, 2);
            const bool is_long = vr == "OB" || vr == "OW" || vr == "OF" || vr == "OD" || vr == "SQ" || vr == "UN" || vr == "UT" || vr == "UC" || vr == "UR";
            if (is_long && at + 12 > bytes_.size()) return std::nullopt;
            const std::uint64_t length = is_long ? number(at + 8, 4) : number(at + 6, 2);
            at += is_long ? 12 : 8;
            if (tag == 0x7fe00010) return found;
            if (length > bytes_.size() - at) return std::nullopt; // also one of undefined length
            if (!is_long) found.emplace(tag, std::string(bytes_.substr(at, length)));
            at += length;
        }
        return found;
    }

private:
    [[nodiscard]] std::uint64_t number(std::size_t at, int bytes) const noexcept {
        std::uint64_t value = 0;
        for (int k = 0; k < bytes; ++k) value |= std::uint64_t{static_cast<unsigned char>(bytes_[at + static_cast<std::size_t>(k)])} << (8 * k);
        return value;
    }
    std::string_view bytes_;
};

/// The numbers of a decimal string; nothing where one is none.
std::optional<std::vector<double>> decimals(std::string_view text) {
    std::vector<double> all;
    while (!text.empty() && (text.back() == ' ' || text.back() == '\0')) text.remove_suffix(1);
    for (;;) {
        while (text.starts_with(' ') || text.starts_with('+')) text.remove_prefix(1);
        double value = 0.0;
        const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (failed != std::errc() || !std::isfinite(value)) return std::nullopt;
        all.push_back(value);
        text.remove_prefix(static_cast<std::size_t>(end - text.data()));
        while (text.starts_with(' ')) text.remove_prefix(1);
        if (text.empty()) return all;
        if (!text.starts_with('\\')) return std::nullopt;
        text.remove_prefix(1);
    }
}

} // namespace

Result<XrayView> read_dicom_view(std::string_view bytes, const std::string& file) {
    const auto wrong = [&](std::string message) { return Error{.code = ErrorCode::BadSyntax, .message = std::move(message), .file = file}; };
    const auto found = DicomScan(bytes).run();
    if (!found) return wrong("is no DICOM file of explicit VR little endian, or ends too early");
    const auto values = [&](std::uint32_t tag, std::size_t count) -> std::optional<std::vector<double>> {
        const auto at = found->find(tag);
        if (at == found->end()) return std::nullopt;
        auto all = decimals(at->second);
        return all && all->size() == count ? all : std::nullopt;
    };
    const auto count = [&](std::uint32_t tag) -> unsigned {
        const auto at = found->find(tag);
        if (at == found->end() || at->second.size() != 2) return 0;
        return static_cast<unsigned char>(at->second[0]) | static_cast<unsigned>(static_cast<unsigned char>(at->second[1])) << 8;
    };
    const auto primary = values(0x00181510, 1), secondary = values(0x00181511, 1), sid = values(0x00181110, 1), sod = values(0x00181111, 1),
               spacing = values(0x00181164, 2);
    const unsigned rows = count(0x00280010), columns = count(0x00280011);
    if (!primary || !secondary || !sid || !sod || !spacing || rows == 0 || columns == 0)
        return wrong("lacks an attribute of the C-arm's geometry; expected (0018,1110), (0018,1111), (0018,1164), (0018,1510), (0018,1511), rows and columns");
    XrayView view;
    view.name = "dicom";
    view.primary = primary->front() * kDegree, view.secondary = secondary->front() * kDegree;
    view.sid = 1e-3 * sid->front(), view.sod = 1e-3 * sod->front();
    view.pixels = {columns, rows};
    view.detector = {1e-3 * (*spacing)[1] * columns, 1e-3 * (*spacing)[0] * rows};
    if (!(view.sod > 0.0) || !(view.sid > view.sod) || !(view.detector[0] > 0.0) || !(view.detector[1] > 0.0))
        return wrong("has distances of no C-arm; expected the detector beyond the patient");
    return view;
}

} // namespace trocar::engine
