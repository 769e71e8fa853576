// NRRD (teem's "nearly raw raster data", version 1 to 5) as label maps, and the fields that Slicer's segmentations add.
#include "engine/io/file_bytes.hpp"
#include "engine/io/label_volume.hpp"
#include "engine/io/volume_header.hpp"

#include <cstring>

namespace trocar::engine::volume {

namespace {

constexpr std::size_t kMostLayers = 256, kMostSegments = 65536;

/// NRRD's names of types that scalar.hpp does not know.
std::optional<ScalarType> find_nrrd_type(const std::string& name) {
    static constexpr std::pair<std::string_view, ScalarType> kMore[] = {
        {"signed char", ScalarType::Int8},         {"int8_t", ScalarType::Int8},
        {"unsigned char", ScalarType::UInt8},      {"uint8_t", ScalarType::UInt8},
        {"short int", ScalarType::Int16},          {"signed short", ScalarType::Int16},
        {"signed short int", ScalarType::Int16},   {"int16_t", ScalarType::Int16},
        {"unsigned short", ScalarType::UInt16},    {"unsigned short int", ScalarType::UInt16},
        {"uint16_t", ScalarType::UInt16},          {"signed int", ScalarType::Int32},
        {"int32_t", ScalarType::Int32},            {"unsigned int", ScalarType::UInt32},
        {"uint32_t", ScalarType::UInt32},          {"longlong", ScalarType::Int64},
        {"long long", ScalarType::Int64},          {"int64_t", ScalarType::Int64},
        {"ulonglong", ScalarType::UInt64},         {"unsigned long long", ScalarType::UInt64},
        {"uint64_t", ScalarType::UInt64},
    };
    for (const auto& [known, type] : kMore)
        if (name == known) return type;
    return find_scalar_type(name);
}

class NrrdReader {
public:
    NrrdReader(const std::filesystem::path& path, const std::string& bytes) : path_(path), name_(path.string()), bytes_(bytes) {}

    Result<LabelVolume> read() {
        for (const auto part : {&NrrdReader::read_header, &NrrdReader::set_sizes, &NrrdReader::set_space, &NrrdReader::set_segments,
                                &NrrdReader::read_data})
            if (const Result<void> done = (this->*part)(); !done.ok()) return done.error();
        return std::move(volume_);
    }

private:
    Error bad(const std::string& key, std::string message) const { return fields_.bad(key, std::move(message)); }
    Error syntax(std::size_t line, std::string message) const { return {ErrorCode::BadSyntax, std::move(message), name_, line}; }
    [[nodiscard]] std::string field(const std::string& key) const { return fields_.get(key); }

    Result<void> read_header() {
        const std::string_view all(bytes_);
        if (all.substr(0, 4) != "NRRD") return syntax(1, "is no NRRD file: the magic NRRD000N is missing");
        std::size_t at = 0, line = 0;
        for (;;) {
            if (at >= all.size() || at > kMostHeaderBytes) break;
            const std::size_t end = std::min(all.find('\n', at), all.size());
            const std::string_view text = strip(all.substr(at, end - at));
            at = end + 1;
            if (++line == 1 || (!text.empty() && text.front() == '#')) continue;
            if (text.empty()) {
                data_at_ = std::min(at, all.size());
                return {};
            }
            const std::size_t mark = text.find(":=");
            const std::size_t colon = mark != text.npos ? mark : text.find(": ") != text.npos ? text.find(": ") : text.find(':');
            if (colon == text.npos) return syntax(line, "expected 'field: value'");
            const std::string key = mark != text.npos ? std::string(text.substr(0, colon)) : lower(strip(text.substr(0, colon)));
            const std::string value(strip(text.substr(colon + (mark != text.npos ? 2 : 1))));
            if (!fields_.add(key, value, line)) return syntax(line, fmt::format("'{}' stands twice", key));
        }
        if (at > kMostHeaderBytes) return syntax(line, fmt::format("the header does not end within {} bytes", kMostHeaderBytes));
        data_at_ = all.size(); // a detached header may end without an empty line
        if (field("data file").empty() && field("datafile").empty()) return syntax(line, "ends within its header");
        return {};
    }

    Result<void> set_sizes() {
        const auto type = find_nrrd_type(lower(field("type")));
        if (!type) return bad("type", fmt::format("found '{}'; expected a type of numbers, such as unsigned char or short", field("type")));
        volume_.type = *type;
        std::size_t dimension = 0;
        if (!parse_number(std::string_view(field("dimension")), dimension) || (dimension != 3 && dimension != 4))
            return bad("dimension", fmt::format("found '{}'; expected 3, or 4 with layers of segments", field("dimension")));
        std::vector<std::size_t> sizes;
        if (!parse_numbers(field("sizes"), dimension, sizes)) return bad("sizes", fmt::format("expected {} integers", dimension));
        layered_ = dimension == 4;
        std::size_t list = 0; // axis of the layers
        if (layered_) {
            const std::vector<std::string_view> kinds = words_of(kept_ = lower(field("kinds")));
            if (kinds.size() == 4 && kinds[3] != "domain" && kinds[3] != "space" && kinds[0] != "list") list = 3;
        }
        layer_axis_ = list;
        std::size_t axis = 0;
        for (std::size_t d = 0; d < dimension; ++d)
            if (layered_ && d == list)
                volume_.layers = sizes[d];
            else
                volume_.size[axis++] = sizes[d];
        if (volume_.layers > kMostLayers) return bad("sizes", fmt::format("{} layers; expected at most {}", volume_.layers, kMostLayers));
        const Result<std::size_t> total = expected_bytes(volume_, name_, "sizes");
        if (!total.ok()) return total.error();
        total_ = *total;
        volume_.voxel_step = layered_ && list == 0 ? volume_.layers : 1;
        volume_.layer_step = layered_ && list == 0 ? 1 : volume_.voxel_count();
        return {};
    }

    Result<double> unit() const {
        const std::string units = field("space units");
        if (units.empty()) return 1e-3;
        std::optional<double> found;
        for (std::size_t at = units.find('"'); at != units.npos; at = units.find('"', at)) {
            const std::size_t end = units.find('"', at + 1);
            if (end == units.npos) break;
            const std::string word = units.substr(at + 1, end - at - 1);
            at = end + 1;
            const double metres = word == "mm" || word == "millimeter" || word.empty() ? 1e-3 : word == "m" ? 1.0 : word == "cm" ? 1e-2 : word == "um" ? 1e-6 : 0.0;
            if (metres == 0.0 || (found && *found != metres)) return bad("space units", fmt::format("found {}; expected mm, cm, m or um", units));
            found = metres;
        }
        return found.value_or(1e-3);
    }

    /// "(1,0,0)" or "none".
    static bool parse_vector(std::string_view text, Vec3& v) {
        if (text.size() < 2 || text.front() != '(' || text.back() != ')') return false;
        text = text.substr(1, text.size() - 2);
        std::string spaced(text);
        for (char& c : spaced)
            if (c == ',') c = ' ';
        std::vector<double> numbers;
        if (!parse_numbers(spaced, 3, numbers)) return false;
        v = Vec3(numbers[0], numbers[1], numbers[2]);
        return true;
    }

    /// Vectors of a field, whatever blanks stand in them.
    static std::vector<std::string> vectors_of(const std::string& text) {
        std::vector<std::string> vectors;
        std::string one;
        bool open = false;
        for (const char c : text + " ") {
            if (c == '(') open = true;
            const bool blank = c == ' ' || c == '\t';
            if (blank && !open && !one.empty()) vectors.push_back(std::exchange(one, {}));
            if (!blank) one += c;
            if (c == ')') open = false;
        }
        return vectors;
    }

    /// Signs of x and y that lead to left and posterior; none: a space that is not read.
    Result<Vec3> signs_of_space() {
        const std::string space = lower(field("space"));
        if (space == "left-posterior-superior" || space == "lps") return Vec3(1, 1, 1);
        if (space == "right-anterior-superior" || space == "ras") return Vec3(-1, -1, 1);
        if (space == "left-anterior-superior" || space == "las") return Vec3(1, -1, 1);
        if (!space.empty() || (!field("space dimension").empty() && field("space dimension") != "3"))
            return bad("space", fmt::format("found '{}'; expected left-posterior-superior, right-anterior-superior or left-anterior-superior", field("space")));
        volume_.notes.emplace_back("the file says no space: left-posterior-superior is assumed");
        return Vec3(1, 1, 1);
    }

    Result<void> set_space() {
        const auto metres = unit();
        if (!metres.ok()) return metres.error();
        const auto signs = signs_of_space();
        if (!signs.ok()) return signs.error();
        const std::size_t dimension = layered_ ? 4 : 3;
        Mat3 axes = Mat3::Identity();
        std::string key = "space directions";
        if (const std::string directions = field(key); !directions.empty()) {
            const std::vector<std::string> vectors = vectors_of(directions);
            if (vectors.size() != dimension) return bad(key, fmt::format("expected {} vectors", dimension));
            int axis = 0;
            for (std::size_t d = 0; d < dimension; ++d) {
                if (layered_ && d == layer_axis_) continue;
                Vec3 v;
                if (!parse_vector(vectors[d], v)) return bad(key, fmt::format("found '{}'; expected three finite numbers, as in (0.5,0,0)", vectors[d]));
                axes.col(axis++) = v;
            }
        } else if (const std::string spacings = field("spacings"); !spacings.empty()) {
            key = "spacings";
            const std::vector<std::string_view> words = words_of(spacings);
            if (words.size() != dimension) return bad(key, fmt::format("expected {} numbers", dimension));
            int axis = 0;
            for (std::size_t d = 0; d < dimension; ++d) {
                double spacing = 0.0;
                if (layered_ && d == layer_axis_) continue;
                if (!parse_number(words[d], spacing) || !std::isfinite(spacing) || !(spacing > 0.0))
                    return bad(key, fmt::format("found '{}'; expected finite numbers above 0", words[d]));
                axes(axis, axis) = spacing;
                ++axis;
            }
        } else {
            volume_.notes.emplace_back("the file says no spacing: voxels of 1 mm are assumed");
        }
        Vec3 origin = Vec3::Zero();
        if (const std::string text = field("space origin"); !text.empty()) {
            const std::vector<std::string> vectors = vectors_of(text);
            if (vectors.size() != 1 || !parse_vector(vectors[0], origin)) return bad("space origin", "expected three finite numbers, as in (0,0,0)");
        }
        return set_frame(volume_, signs->asDiagonal() * axes, signs->cwiseProduct(origin), *metres, false, name_, key);
    }

    Result<void> set_segments() {
        for (std::size_t n = 0; n < kMostSegments; ++n) {
            const std::string stem = fmt::format("Segment{}_", n);
            if (!fields_.has(stem + "Name") && !fields_.has(stem + "ID") && !fields_.has(stem + "LabelValue")) break;
            LabelSegment segment;
            segment.name = field(stem + "Name").empty() ? field(stem + "ID") : field(stem + "Name");
            if (const std::string value = field(stem + "LabelValue"); !value.empty() && !parse_number(std::string_view(value), segment.value))
                return bad(stem + "LabelValue", fmt::format("found '{}'; expected a whole number", value));
            if (const std::string layer = field(stem + "Layer"); !layer.empty() && !parse_number(std::string_view(layer), segment.layer))
                return bad(stem + "Layer", fmt::format("found '{}'; expected a whole number", layer));
            if (segment.layer >= volume_.layers)
                return bad(stem + "Layer", fmt::format("found {}; expected one of the {} layers", segment.layer, volume_.layers));
            for (const LabelSegment& other : volume_.segments)
                if (other.value == segment.value && other.layer == segment.layer)
                    return bad(stem + "LabelValue", fmt::format("found {} in layer {}, which is the segment '{}' already", segment.value, segment.layer, other.name));
            volume_.segments.push_back(std::move(segment));
        }
        return {};
    }

    Result<void> read_data() {
        const std::string endian = lower(field("endian"));
        const std::string encoding = lower(field("encoding"));
        if (size_of(volume_.type) > 1 && encoding != "ascii" && encoding != "text" && encoding != "txt" && endian != "little" && endian != "big")
            return bad("endian", fmt::format("found '{}'; expected little or big", endian));
        volume_.big = endian == "big";
        std::string named = field("data file").empty() ? field("datafile") : field("data file");
        std::string_view data = std::string_view(bytes_).substr(data_at_);
        Result<std::string> detached = std::string();
        if (!named.empty()) {
            if (named.rfind("LIST", 0) == 0 || named.find('%') != named.npos) return bad("data file", "expected one file, not a list or a pattern");
            const auto file = find_data_file(path_, named, "data file");
            if (!file.ok()) return file.error();
            detached = read_packed_bytes(*file);
            if (!detached.ok()) return detached.error();
            data = *detached;
            data_name_ = file->string();
        } else {
            data_name_ = name_;
        }
        if (const Result<void> skipped = skip(data, encoding); !skipped.ok()) return skipped;
        if (encoding == "raw" || encoding == "gzip" || encoding == "gz") return take_voxels(volume_, data, encoding != "raw", total_, data_name_, "sizes");
        if (encoding == "ascii" || encoding == "text" || encoding == "txt") return take_text(data);
        return bad("encoding", fmt::format("found '{}'; expected raw, gzip or ascii", encoding));
    }

    Result<void> skip(std::string_view& data, const std::string& encoding) {
        for (const char* key : {"line skip", "byte skip"}) {
            const std::string text = field(key);
            if (text.empty() || text == "0") continue;
            std::int64_t count = 0;
            const bool lines = key[0] == 'l';
            if (!parse_number(std::string_view(text), count) || count < (lines ? 0 : -1))
                return bad(key, fmt::format("found '{}'; expected a whole number that is not negative", text));
            if (lines)
                for (; count > 0; --count) {
                    const std::size_t end = data.find('\n');
                    if (end == data.npos) return bad(key, fmt::format("found {}; the data has fewer lines", text));
                    data.remove_prefix(end + 1);
                }
            else if (count == -1 && encoding == "raw" && data.size() >= total_)
                data.remove_prefix(data.size() - total_);
            else if (count < 0 || static_cast<std::size_t>(count) > data.size())
                return bad(key, fmt::format("found {}; the data has {} bytes", text, data.size()));
            else
                data.remove_prefix(static_cast<std::size_t>(count));
        }
        return {};
    }

    Result<void> take_text(std::string_view data) {
        const std::size_t count = total_ / size_of(volume_.type);
        volume_.type = ScalarType::Float64;
        volume_.big = false;
        if (count > data.size() || count > kMostVolumeBytes / sizeof(double)) // a digit each at least
            return Error{ErrorCode::BadSyntax, fmt::format("has {} bytes of text; the header announces {} numbers", data.size(), count), data_name_};
        volume_.bytes.reserve(count * sizeof(double));
        for (std::size_t i = 0; i < count; ++i) {
            data = data.substr(std::min(data.find_first_not_of(" \t\r\n,"), data.size()));
            const std::size_t end = std::min(data.find_first_of(" \t\r\n,"), data.size());
            double value = 0.0;
            if (!parse_number(data.substr(0, end), value) || !std::isfinite(value))
                return Error{ErrorCode::BadSyntax, fmt::format("number {} of {} is missing or no number", i, count), data_name_};
            volume_.bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
            data.remove_prefix(end);
        }
        if (data.find_first_not_of(" \t\r\n,") != data.npos)
            return Error{ErrorCode::BadSyntax, fmt::format("more numbers follow the {} that the header announces; expected sizes that fit the data", count), data_name_, 0, 0, "sizes"};
        return {};
    }

    const std::filesystem::path& path_;
    std::string name_, data_name_, kept_;
    const std::string& bytes_;
    HeaderFields fields_{name_};
    std::size_t data_at_ = 0, total_ = 0, layer_axis_ = 0;
    bool layered_ = false;
    LabelVolume volume_;
};

} // namespace

Result<LabelVolume> read_nrrd(const std::filesystem::path& path, const std::string& bytes) { return NrrdReader(path, bytes).read(); }

} // namespace trocar::engine::volume
