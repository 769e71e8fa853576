// MetaImage as label maps: .mha with its data, .mhd with a data file beside it; plain or zlib.
#include "engine/io/file_bytes.hpp"
#include "engine/io/label_volume.hpp"
#include "engine/io/volume_header.hpp"

namespace trocar::engine::volume {

namespace {

std::optional<ScalarType> find_meta_type(const std::string& name) {
    static constexpr std::pair<std::string_view, ScalarType> kTypes[] = {
        {"MET_CHAR", ScalarType::Int8},       {"MET_UCHAR", ScalarType::UInt8},   {"MET_SHORT", ScalarType::Int16},
        {"MET_USHORT", ScalarType::UInt16},   {"MET_INT", ScalarType::Int32},     {"MET_UINT", ScalarType::UInt32},
        {"MET_LONG", ScalarType::Int32},      {"MET_ULONG", ScalarType::UInt32},  {"MET_LONG_LONG", ScalarType::Int64},
        {"MET_ULONG_LONG", ScalarType::UInt64}, {"MET_FLOAT", ScalarType::Float32}, {"MET_DOUBLE", ScalarType::Float64},
    };
    for (const auto& [known, type] : kTypes)
        if (name == known) return type;
    return std::nullopt;
}

class MetaReader {
public:
    MetaReader(const std::filesystem::path& path, const std::string& bytes) : path_(path), name_(path.string()), bytes_(bytes) {}

    Result<LabelVolume> read() {
        for (const auto part : {&MetaReader::read_header, &MetaReader::set_sizes, &MetaReader::set_space, &MetaReader::read_data})
            if (const Result<void> done = (this->*part)(); !done.ok()) return done.error();
        return std::move(volume_);
    }

private:
    Error bad(const std::string& key, std::string message) const { return fields_.bad(key, std::move(message)); }
    [[nodiscard]] std::string field(const std::string& key) const { return fields_.get(key); }
    [[nodiscard]] bool flag(const std::string& key) const { return lower(field(key)) == "true" || field(key) == "1"; }

    Result<void> read_header() {
        const std::string_view all(bytes_);
        std::size_t line = 0;
        for (std::size_t at = 0; at < all.size() && at < kMostHeaderBytes;) {
            const std::size_t end = std::min(all.find('\n', at), all.size());
            const std::string_view text = strip(all.substr(at, end - at));
            at = end + 1;
            ++line;
            if (text.empty()) continue;
            const std::size_t mark = text.find('=');
            if (mark == text.npos) return Error{ErrorCode::BadSyntax, "expected 'Key = value'", name_, line};
            const std::string key(strip(text.substr(0, mark)));
            if (!fields_.add(key, std::string(strip(text.substr(mark + 1))), line))
                return Error{ErrorCode::BadSyntax, fmt::format("'{}' stands twice", key), name_, line};
            if (key != "ElementDataFile") continue;
            data_at_ = std::min(at, all.size());
            return {};
        }
        return Error{ErrorCode::BadSyntax, "is no MetaImage file: its header has no ElementDataFile", name_, line};
    }

    Result<void> set_sizes() {
        if (!field("ObjectType").empty() && field("ObjectType") != "Image") return bad("ObjectType", fmt::format("found '{}'; expected Image", field("ObjectType")));
        if (field("NDims") != "3") return bad("NDims", fmt::format("found '{}'; expected 3", field("NDims")));
        if (!field("ElementNumberOfChannels").empty() && field("ElementNumberOfChannels") != "1")
            return bad("ElementNumberOfChannels", fmt::format("found '{}'; expected 1", field("ElementNumberOfChannels")));
        const auto type = find_meta_type(field("ElementType"));
        if (!type) return bad("ElementType", fmt::format("found '{}'; expected MET_UCHAR, MET_SHORT, ...", field("ElementType")));
        volume_.type = *type;
        volume_.big = flag("BinaryDataByteOrderMSB") || flag("ElementByteOrderMSB");
        volume_.order_key = "BinaryDataByteOrderMSB";
        if (!field("BinaryData").empty() && !flag("BinaryData")) return bad("BinaryData", "expected True: text is not read");
        std::vector<std::size_t> sizes;
        if (!parse_numbers(field("DimSize"), 3, sizes)) return bad("DimSize", "expected three integers");
        std::copy(sizes.begin(), sizes.end(), volume_.size.begin());
        const Result<std::size_t> total = expected_bytes(volume_, name_, "DimSize");
        if (!total.ok()) return total.error();
        total_ = *total;
        volume_.layer_step = volume_.voxel_count();
        return {};
    }

    /// The first of some keys that the file has.
    [[nodiscard]] std::string first_of(std::initializer_list<const char*> keys, std::string& key) const {
        for (const char* each : keys)
            if (fields_.has(each)) return key = each, field(each);
        return {};
    }

    Result<void> set_space() {
        std::string key = "ElementSpacing";
        std::vector<double> spacing, turn, origin;
        if (const std::string text = first_of({"ElementSpacing", "ElementSize"}, key); text.empty()) {
            spacing = {1, 1, 1};
            volume_.notes.emplace_back("the file says no spacing: voxels of 1 mm are assumed");
        } else if (!parse_numbers(text, 3, spacing) || !(std::min({spacing[0], spacing[1], spacing[2]}) > 0.0)) {
            return bad(key, fmt::format("found '{}'; expected three finite numbers above 0", text));
        }
        if (const std::string text = first_of({"TransformMatrix", "Orientation", "Rotation"}, key); text.empty())
            turn = {1, 0, 0, 0, 1, 0, 0, 0, 1};
        else if (!parse_numbers(text, 9, turn))
            return bad(key, fmt::format("found '{}'; expected nine finite numbers", text));
        std::string origin_key;
        if (const std::string text = first_of({"Offset", "Position", "Origin"}, origin_key); text.empty())
            origin = {0, 0, 0};
        else if (!parse_numbers(text, 3, origin))
            return bad(origin_key, fmt::format("found '{}'; expected three finite numbers", text));
        Mat3 axes;
        for (int axis = 0; axis < 3; ++axis)
            for (int row = 0; row < 3; ++row) // the matrix lists the axes one after another
                axes(row, axis) = spacing[static_cast<std::size_t>(axis)] * turn[static_cast<std::size_t>(3 * axis + row)];
        return set_frame(volume_, axes, Vec3(origin[0], origin[1], origin[2]), 1e-3, false, name_, key);
    }

    Result<void> read_data() {
        const std::string named = field("ElementDataFile");
        std::string data_name = name_;
        std::string_view data = std::string_view(bytes_).substr(data_at_);
        Result<std::string> detached = std::string();
        if (named.rfind("LIST", 0) == 0 || named.find('%') != named.npos) return bad("ElementDataFile", "expected one file, not a list or a pattern");
        if (named != "LOCAL") {
            const auto file = find_data_file(path_, named, "ElementDataFile");
            if (!file.ok()) return file.error();
            detached = read_packed_bytes(*file);
            if (!detached.ok()) return detached.error();
            data = *detached;
            data_name = file->string();
        }
        if (const std::string text = field("HeaderSize"); !text.empty() && text != "0") {
            std::int64_t skipped = 0;
            if (!parse_number(std::string_view(text), skipped) || skipped < -1 || (skipped > 0 && static_cast<std::size_t>(skipped) > data.size()))
                return bad("HeaderSize", fmt::format("found '{}'; the data has {} bytes", text, data.size()));
            if (skipped > 0) data.remove_prefix(static_cast<std::size_t>(skipped));
            if (skipped == -1 && data.size() > total_) data.remove_prefix(data.size() - total_);
        }
        return take_voxels(volume_, data, flag("CompressedData"), total_, data_name, "DimSize");
    }

    const std::filesystem::path& path_;
    std::string name_;
    const std::string& bytes_;
    HeaderFields fields_{name_};
    std::size_t data_at_ = 0, total_ = 0;
    LabelVolume volume_;
};

} // namespace

Result<LabelVolume> read_metaimage(const std::filesystem::path& path, const std::string& bytes) { return MetaReader(path, bytes).read(); }

} // namespace trocar::engine::volume
