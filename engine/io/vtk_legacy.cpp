// VTK legacy files (.vtk): PolyData and unstructured grids, text and binary (most significant byte first), cells in
// the old layout (size, ids...) and in that of version 5 (offsets, connectivity).
#include "engine/io/formats.hpp"
#include "engine/io/scalar.hpp"
#include "engine/io/scanner.hpp"
#include "engine/io/shown.hpp"

#include <fmt/format.h>

#include <cctype>

namespace trocar::engine {
namespace {

std::string upper(std::string_view word) {
    std::string text(word.substr(0, 40));
    for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return text;
}

class VtkReader {
public:
    VtkReader(std::string_view bytes, const std::string& name, bool with_data) : in_(bytes, name), name_(name), with_data_(with_data) {}

    Result<VtkMesh> read() {
        if (!read_header()) return in_.error();
        bool more = true;
        while (more && !in_.at_end())
            if (!read_section(more)) return in_.error();
        return std::move(out_);
    }

private:
    bool read_header() {
        const std::string_view first = in_.rest_of_line();
        constexpr std::string_view kMagic = "# vtk DataFile Version ";
        if (!first.starts_with(kMagic)) return in_.fail(ErrorCode::BadSyntax, "does not begin with '# vtk DataFile Version'");
        five_ = first.size() > kMagic.size() && first[kMagic.size()] >= '5';
        in_.skip_line(); // the title
        std::string_view word;
        if (!in_.word(word, "ASCII or BINARY")) return false;
        binary_ = upper(word) == "BINARY";
        if (!binary_ && upper(word) != "ASCII") return in_.fail(ErrorCode::BadSyntax, "ASCII or BINARY should stand here");
        in_.set_binary(binary_);
        if (!in_.word(word, "DATASET") || upper(word) != "DATASET") return in_.fail(ErrorCode::BadSyntax, "DATASET should stand here");
        if (!in_.word(word, "the kind of data set")) return false;
        out_.unstructured = upper(word) == "UNSTRUCTURED_GRID";
        return out_.unstructured || upper(word) == "POLYDATA" ||
               in_.fail(ErrorCode::BadValue, fmt::format("data set {} is not read; POLYDATA and UNSTRUCTURED_GRID are", upper(word)));
    }

    bool read_section(bool& more) {
        std::string_view word;
        if (!in_.word(word, "a section")) return false;
        const std::string section = upper(word);
        VtkCells passed_over;
        if (section == "POINTS") return read_points();
        if (section == "CELL_TYPES") return read_types();
        if (section == "CELLS") return read_cells(out_.cells);
        if (section == "POLYGONS") return read_cells(out_.polygons);
        if (section == "TRIANGLE_STRIPS") return read_cells(out_.strips);
        if (section == "LINES" || section == "VERTICES") return read_cells(passed_over);
        if (section == "METADATA") return pass_over_metadata();
        if (section == "FIELD") return read_field();
        const bool data = section == "POINT_DATA" || section == "CELL_DATA";
        if (with_data_ && data) {
            data_of_ = section == "CELL_DATA" ? DataOf::Cells : DataOf::Points;
            return in_.count(tuples_, "the number of tuples", 0);
        }
        if (data_of_ != DataOf::Nothing) return read_attribute(section);
        more = !data; // nothing of ours follows them
        return !more || in_.fail(ErrorCode::BadSyntax, fmt::format("'{}' is no section of a VTK file", shown(section)));
    }

    bool read_type(ScalarType& type) {
        std::string_view word;
        if (!in_.word(word, "a type")) return false;
        const std::optional<ScalarType> found = find_scalar_type(word);
        if (!found) return in_.fail(ErrorCode::BadValue, fmt::format("type '{}' is not read", shown(word)));
        // VTK's 'long' had the size of the writer's machine; 64 bits are the only ones still met.
        type = *found;
        in_.skip_line();
        return true;
    }

    bool check_size(std::size_t count, std::size_t width, const char* what) { return in_.check_fits(count, binary_ ? width : 1, what); }

    bool read_points() {
        std::size_t count = 0;
        ScalarType type{};
        if (!in_.count(count, "the number of points", 3) || !read_type(type)) return false;
        if (count >= kNoIndex) return in_.fail(ErrorCode::BadMesh, "more points than indices");
        if (!check_size(count, 3 * size_of(type), "the number of points")) return false;
        out_.points.resize(count);
        for (std::size_t i = 0; i < count; ++i) {
            Vec3& point = out_.points[i];
            if (!binary_) {
                if (!in_.point(point, i)) return false;
                continue;
            }
            std::string_view bytes;
            if (!in_.raw(bytes, 3 * size_of(type), "points")) return false;
            for (std::size_t k = 0; k < 3; ++k) point[static_cast<int>(k)] = load_real(bytes.data() + k * size_of(type), type, true);
            if (!is_finite(point)) return in_.fail_not_finite(i);
        }
        return true;
    }

    bool read_integers(std::vector<std::int64_t>& out, std::size_t count, ScalarType type, const char* what) {
        if (is_real(type)) return in_.fail(ErrorCode::BadValue, fmt::format("{} must be integers", what));
        if (!check_size(count, size_of(type), what)) return false;
        out.resize(count);
        if (!binary_) {
            for (std::int64_t& value : out)
                if (!in_.integer(value, what)) return false;
            return true;
        }
        std::string_view bytes;
        if (!in_.raw(bytes, count * size_of(type), what)) return false;
        for (std::size_t i = 0; i < count; ++i) out[i] = load_integer(bytes.data() + i * size_of(type), type, true);
        return true;
    }

    bool read_cells(VtkCells& cells) {
        std::size_t count = 0, size = 0;
        if (!in_.count(count, "the number of cells", 1) || !in_.count(size, "the cells' size", 1)) return false;
        in_.skip_line();
        if (five_) return read_cells_five(cells, count, size);
        std::vector<std::int64_t> numbers;
        if (!read_integers(numbers, size, ScalarType::Int32, "the cells")) return false;
        cells = {};
        std::size_t at = 0;
        for (std::size_t i = 0; i < count; ++i) {
            if (at >= size || numbers[at] < 0 || static_cast<std::size_t>(numbers[at]) > size - at - 1)
                return in_.fail(ErrorCode::BadSyntax, fmt::format("cell {} of {} does not fit into the {} numbers given", i, count, size));
            const auto corners = static_cast<std::size_t>(numbers[at]);
            const auto first = numbers.begin() + static_cast<std::ptrdiff_t>(at + 1);
            cells.connectivity.insert(cells.connectivity.end(), first, first + static_cast<std::ptrdiff_t>(corners));
            cells.ends.push_back(static_cast<std::int64_t>(cells.connectivity.size()));
            at += corners + 1;
        }
        return at == size || in_.fail(ErrorCode::BadSyntax, fmt::format("{} cells use {} of {} numbers", count, at, size));
    }

    /// offsets  [offset_count] begin of each cell and, last, the end of all
    bool read_cells_five(VtkCells& cells, std::size_t offset_count, std::size_t size) {
        cells = {};
        ScalarType type{};
        std::string_view word;
        if (!in_.word(word, "OFFSETS") || upper(word) != "OFFSETS") return in_.fail(ErrorCode::BadSyntax, "OFFSETS should stand here");
        if (!read_type(type) || !read_integers(cells.ends, offset_count, type, "the offsets")) return false;
        if (!in_.word(word, "CONNECTIVITY") || upper(word) != "CONNECTIVITY")
            return in_.fail(ErrorCode::BadSyntax, "CONNECTIVITY should stand here");
        if (!read_type(type) || !read_integers(cells.connectivity, size, type, "the connectivity")) return false;
        if (cells.ends.empty()) return true;
        if (cells.ends.front() != 0) return in_.fail(ErrorCode::BadSyntax, "the first offset is not 0");
        cells.ends.erase(cells.ends.begin());
        return true;
    }

    bool read_types() {
        std::size_t count = 0;
        if (!in_.count(count, "the number of cell types", 1)) return false;
        in_.skip_line();
        std::vector<std::int64_t> types;
        if (!read_integers(types, count, ScalarType::Int32, "the cell types")) return false;
        out_.cells.types.clear();
        for (const std::int64_t type : types) out_.cells.types.push_back(type < 0 || type > 255 ? 0 : static_cast<std::uint8_t>(type));
        return true;
    }

    /// Ends at a blank line.
    bool pass_over_metadata() {
        in_.skip_line();
        while (in_.left() > 0 && !in_.rest_of_line().empty()) {
        }
        return true;
    }

    /// An array of the points or cells; only those of one number or three a cell are kept.
    bool read_attribute(const std::string& kind) {
        std::string_view name;
        if (!in_.word(name, "an array's name")) return false;
        std::size_t components = kind == "SCALARS" || kind == "GLOBAL_IDS" || kind == "PEDIGREE_IDS" ? 1
                                 : kind == "VECTORS" || kind == "NORMALS"                            ? 3
                                 : kind == "TENSORS6"                                                ? 6
                                 : kind == "TENSORS"                                                 ? 9
                                                                                                     : 0;
        ScalarType type{};
        if (kind == "SCALARS") return read_scalars(std::string(name));
        if (components > 0) return read_type(type) && read_array(std::string(name), components, tuples_, type);
        const bool colours = kind == "COLOR_SCALARS", texture = kind == "TEXTURE_COORDINATES";
        if (!colours && !texture && kind != "LOOKUP_TABLE") return in_.fail(ErrorCode::BadSyntax, fmt::format("'{}' is no array of a VTK file", shown(kind)));
        std::size_t count = 0; // numbers a tuple; of a table its rows of four
        if (!in_.count(count, "a number of components", 0)) return false;
        if (texture) return read_type(type) && pass_over_array(count, tuples_, type);
        in_.skip_line();
        const ScalarType colour = binary_ ? ScalarType::UInt8 : ScalarType::Float64; // bytes, or shares as text
        return pass_over_array(colours ? count : 4, colours ? tuples_ : count, colour);
    }

    /// type [components], then LOOKUP_TABLE name, then the data.
    bool read_scalars(std::string name) {
        std::string_view word;
        std::size_t components = 1;
        if (!in_.word(word, "a type")) return false;
        const std::optional<ScalarType> type = find_scalar_type(word);
        if (!type) return in_.fail(ErrorCode::BadValue, fmt::format("type '{}' is not read", shown(word)));
        if (!in_.at_line_end() && !in_.count(components, "the number of components", 0)) return false;
        if (!in_.word(word, "LOOKUP_TABLE") || upper(word) != "LOOKUP_TABLE") return in_.fail(ErrorCode::BadSyntax, "LOOKUP_TABLE should stand here");
        in_.skip_line();
        return read_array(std::move(name), components, tuples_, *type);
    }

    bool read_array(std::string name, std::size_t components, std::size_t tuples, ScalarType type) {
        if (data_of_ != DataOf::Cells || (components != 1 && components != 3)) return pass_over_array(components, tuples, type);
        if (!check_size(tuples, components * size_of(type), "the number of tuples")) return false;
        std::vector<double> values(components * tuples);
        std::string_view bytes;
        if (binary_ && !in_.raw(bytes, values.size() * size_of(type), "an array")) return false;
        for (std::size_t i = 0; i < values.size(); ++i)
            if (binary_)
                values[i] = load_real(bytes.data() + i * size_of(type), type, true);
            else if (!in_.real(values[i], "a number"))
                return false;
        (components == 1 ? out_.of_cells : out_.vectors_of_cells).emplace_back(std::move(name), std::move(values));
        return true;
    }

    /// FIELD name count, then arrays: name components tuples type, data.
    bool read_field() {
        std::string_view word;
        std::size_t arrays = 0;
        if (!in_.word(word, "the field's name") || !in_.count(arrays, "the number of arrays", 4)) return false;
        for (std::size_t i = 0; i < arrays; ++i) {
            std::size_t components = 0, tuples = 0;
            ScalarType type{};
            if (in_.peek_word() == "METADATA" && (!in_.word(word, "METADATA") || !pass_over_metadata())) return false; // of the array before
            if (!in_.word(word, "an array's name") || !in_.count(components, "the number of components", 0) ||
                !in_.count(tuples, "the number of tuples", 0) || !read_type(type) || !read_array(std::string(word), components, tuples, type))
                return false;
        }
        return true;
    }

    bool pass_over_array(std::size_t components, std::size_t tuples, ScalarType type) {
        if (components == 0 || tuples == 0) return true;
        if (!check_size(components, size_of(type), "the number of components") ||
            !check_size(tuples, components * size_of(type), "the number of tuples"))
            return false;
        std::string_view bytes;
        if (binary_) return in_.raw(bytes, components * tuples * size_of(type), "an array");
        double ignored = 0;
        for (std::size_t i = 0; i / components < tuples; ++i)
            if (!in_.real(ignored, "a number")) return false;
        return true;
    }

    Scanner in_;
    const std::string& name_;
    VtkMesh out_;
    bool with_data_, five_ = false, binary_ = false;
    enum class DataOf : std::uint8_t { Nothing, Points, Cells } data_of_ = DataOf::Nothing; // in whose arrays we are
    std::size_t tuples_ = 0;                                                               // of each of them
};

} // namespace

Result<VtkMesh> parse_vtk_legacy(std::string_view bytes, const std::string& name, bool with_data) { return VtkReader(bytes, name, with_data).read(); }

} // namespace trocar::engine
