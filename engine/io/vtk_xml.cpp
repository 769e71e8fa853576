// VTK XML files: VTP and VTU; arrays as text, base64, appended base64 or appended raw, zlib-compressed or not, in both
// byte orders. Several pieces become one mesh.
#include "engine/io/file_bytes.hpp"
#include "engine/io/formats.hpp"
#include "engine/io/scanner.hpp"
#include "engine/io/vtk_array.hpp"

#include <fmt/format.h>
#include <pugixml.hpp>

#include <algorithm>
#include <cstring>
#include <optional>

namespace trocar::engine {
namespace {

/// A VTK file has a few dozen tags; a hostile one of millions would cost the parser a hundred bytes for each.
constexpr std::ptrdiff_t kMaxTags = 100000;

class VtkXmlReader {
public:
    VtkXmlReader(std::string_view bytes, const std::string& name, bool with_data) : name_(name), bytes_(bytes), with_data_(with_data) {}

    Result<VtkMesh> read() {
        if (!load() || !read_pieces()) return *error_;
        return std::move(out_);
    }

private:
    bool fail(ErrorCode code, std::string message, std::size_t at) {
        const std::size_t safe = std::min(at, bytes_.size());
        const auto line =
            1 + static_cast<std::size_t>(std::count(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(safe), '\n'));
        error_ = Error{code, std::move(message), name_, line};
        return false;
    }
    bool fail(ErrorCode code, std::string message, const pugi::xml_node& node) {
        return fail(code, std::move(message), static_cast<std::size_t>(std::max<std::ptrdiff_t>(node.offset_debug(), 0)));
    }

    /// Raw appended data are no XML: the text ends where they begin.
    bool load() {
        std::string xml(bytes_);
        const std::size_t tag = bytes_.find("<AppendedData");
        const std::size_t open = tag == bytes_.npos ? tag : bytes_.find('>', tag);
        const std::size_t mark = open == bytes_.npos ? open : bytes_.find('_', open);
        if (mark != bytes_.npos) {
            xml.resize(open + 1);
            xml += "</AppendedData></VTKFile>";
            format_.appended = bytes_.substr(mark + 1);
        }
        if (std::count(xml.begin(), xml.end(), '<') > kMaxTags) return fail(ErrorCode::BadSyntax, "has too many tags for a VTK file", 0);
        const pugi::xml_parse_result parsed = document_.load_buffer(xml.data(), xml.size(), pugi::parse_minimal);
        if (!parsed)
            return fail(ErrorCode::BadSyntax, fmt::format("is no well-formed XML: {}", parsed.description()),
                        static_cast<std::size_t>(parsed.offset));
        return read_root();
    }

    bool read_root() {
        const pugi::xml_node root = document_.child("VTKFile");
        const std::string_view type = root.attribute("type").value();
        if (!root) return fail(ErrorCode::BadSyntax, "is no VTK file: <VTKFile> is missing", 0);
        out_.unstructured = type == "UnstructuredGrid";
        if (!out_.unstructured && type != "PolyData")
            return fail(ErrorCode::BadValue, fmt::format("type '{}' is not read; PolyData and UnstructuredGrid are", type), root);
        format_.file_bytes = bytes_.size();
        format_.big = std::string_view(root.attribute("byte_order").value()) == "BigEndian";
        format_.long_header = std::string_view(root.attribute("header_type").value()) == "UInt64";
        const std::string_view compressor = root.attribute("compressor").value();
        format_.compressed = !compressor.empty();
        if (format_.compressed && compressor != "vtkZLibDataCompressor")
            return fail(ErrorCode::BadValue, fmt::format("compressor '{}' is not read; vtkZLibDataCompressor is", compressor), root);
        format_.raw_appended = std::string_view(root.child("AppendedData").attribute("encoding").value()) == "raw";
        grid_ = root.child(out_.unstructured ? "UnstructuredGrid" : "PolyData");
        return !grid_.empty() || fail(ErrorCode::BadSyntax, "has no grid inside <VTKFile>", root);
    }

    bool read_pieces() {
        for (const pugi::xml_node piece : grid_.children("Piece"))
            if (!read_piece(piece)) return false;
        return out_.points.size() < kNoIndex || fail(ErrorCode::BadMesh, "more points than indices", 0);
    }

    bool read_piece(const pugi::xml_node& piece) {
        const auto first = static_cast<std::int64_t>(out_.points.size());
        const pugi::xml_node points = piece.child("Points").child("DataArray");
        if (!points) return true; // an empty piece
        std::vector<double> numbers;
        if (!read_array(points, &numbers, nullptr)) return false;
        if (numbers.size() % 3 != 0 || numbers.size() / 3 != piece.attribute("NumberOfPoints").as_ullong())
            return fail(
                ErrorCode::BadSyntax,
                fmt::format("{} points are announced, {} coordinates given", piece.attribute("NumberOfPoints").value(), numbers.size()),
                points);
        for (std::size_t i = 0; i + 2 < numbers.size(); i += 3) {
            out_.points.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
            if (!is_finite(out_.points.back()))
                return fail(ErrorCode::BadValue, fmt::format("vertex {} has a coordinate that is not finite", i / 3), points);
        }
        if (out_.unstructured)
            return read_cells(piece.child("Cells"), out_.cells, first, piece.attribute("NumberOfCells").as_ullong()) &&
                   (!with_data_ || (read_data(piece.child("CellData"), out_.of_cells) && read_data(piece.child("CellData"), out_.vectors_of_cells, "3")));
        if (with_data_ && !(read_cells(piece.child("Lines"), out_.lines, first, piece.attribute("NumberOfLines").as_ullong()) &&
                             read_data(piece.child("PointData"), out_.of_points) && read_data(piece.child("CellData"), out_.of_cells)))
            return false;
        return read_cells(piece.child("Polys"), out_.polygons, first, piece.attribute("NumberOfPolys").as_ullong()) &&
               read_cells(piece.child("Strips"), out_.strips, first, piece.attribute("NumberOfStrips").as_ullong());
    }

    /// Arrays of so many components, by name; of several pieces one after another.
    bool read_data(const pugi::xml_node& node, std::vector<std::pair<std::string, std::vector<double>>>& arrays, std::string_view wanted = "1") {
        for (const pugi::xml_node array : node.children("DataArray")) {
            const std::string components = array.attribute("NumberOfComponents").value();
            if ((components.empty() ? "1" : components) != wanted || !find_scalar_type(array.attribute("type").value())) continue;
            const std::string name = array.attribute("Name").value();
            auto known = std::find_if(arrays.begin(), arrays.end(), [&](const auto& each) { return each.first == name; });
            if (known == arrays.end()) known = arrays.insert(arrays.end(), {name, {}});
            if (!read_array(array, &known->second, nullptr)) return false;
        }
        return true;
    }

    bool read_cells(const pugi::xml_node& node, VtkCells& cells, std::int64_t first_point, std::size_t announced) {
        if (!node) return true;
        const auto first = static_cast<std::int64_t>(cells.connectivity.size());
        std::vector<std::int64_t> connectivity, ends, types;
        if (!read_named(node, "connectivity", connectivity) || !read_named(node, "offsets", ends)) return false;
        if (out_.unstructured && !read_named(node, "types", types)) return false;
        if (ends.size() != announced || (out_.unstructured && types.size() != announced))
            return fail(ErrorCode::BadSyntax,
                        fmt::format("{} cells are announced, {} offsets and {} types given", announced, ends.size(), types.size()), node);
        // A piece must not reach into the next one.
        if (!ends.empty() && ends.back() != static_cast<std::int64_t>(connectivity.size()))
            return fail(ErrorCode::BadSyntax,
                        fmt::format("the last offset is {}, the connectivity has {} entries", ends.back(), connectivity.size()), node);
        const std::int64_t points = static_cast<std::int64_t>(out_.points.size()) - first_point;
        for (const std::int64_t id : connectivity) cells.connectivity.push_back(id < 0 || id >= points ? -1 : id + first_point);
        for (const std::int64_t end : ends) {
            if (end < 0 || end > static_cast<std::int64_t>(connectivity.size()))
                return fail(ErrorCode::BadSyntax, fmt::format("offset {} of {}", end, connectivity.size()), node);
            cells.ends.push_back(first + end);
        }
        for (const std::int64_t type : types) cells.types.push_back(type < 0 || type > 255 ? 0 : static_cast<std::uint8_t>(type));
        return true;
    }

    bool read_named(const pugi::xml_node& parent, const char* array, std::vector<std::int64_t>& out) {
        const pugi::xml_node node = parent.find_child_by_attribute("DataArray", "Name", array);
        if (!node) return fail(ErrorCode::BadSyntax, fmt::format("the array '{}' is missing", array), parent);
        return read_array(node, nullptr, &out);
    }

    /// Exactly one of the outputs is wanted.
    bool read_array(const pugi::xml_node& node, std::vector<double>* reals, std::vector<std::int64_t>* integers) {
        const auto type = find_scalar_type(node.attribute("type").value());
        if (!type || (integers && is_real(*type)))
            return fail(ErrorCode::BadValue, fmt::format("type '{}' does not fit here", node.attribute("type").value()), node);
        const std::string_view format = node.attribute("format").value();
        if (format == "ascii") return read_text(node, reals, integers);
        const bool appended = format == "appended";
        if (!appended && format != "binary") return fail(ErrorCode::BadValue, fmt::format("format '{}' is not read", format), node);
        const std::size_t offset = node.attribute("offset").as_ullong();
        if (appended && offset > format_.appended.size())
            return fail(ErrorCode::BadSyntax, fmt::format("offset {} of {} appended bytes", offset, format_.appended.size()), node);
        const std::string_view packed = appended ? format_.appended.substr(offset) : std::string_view(node.child_value());
        const Result<std::string> bytes = unpack_vtk_array(packed, format_, appended && format_.raw_appended);
        if (!bytes) return fail(bytes.error().code, bytes.error().message, node);
        // Every byte is an array's once, unless many arrays name one place of the appended data.
        const std::size_t most = format_.compressed ? max_unfolded_bytes(bytes_.size()) : bytes_.size();
        unpacked_ += bytes->size();
        if (unpacked_ > most)
            return fail(ErrorCode::BadSyntax, fmt::format("its arrays unfold to more than {} bytes: not a mesh", most), node);
        const std::size_t width = size_of(*type);
        if (bytes->size() % width != 0)
            return fail(ErrorCode::BadSyntax, fmt::format("{} bytes are no whole {}s", bytes->size(), node.attribute("type").value()),
                        node);
        for (std::size_t at = 0; at < bytes->size(); at += width) {
            if (reals)
                reals->push_back(load_real(bytes->data() + at, *type, format_.big));
            else
                integers->push_back(load_integer(bytes->data() + at, *type, format_.big));
        }
        return true;
    }

    bool read_text(const pugi::xml_node& node, std::vector<double>* reals, std::vector<std::int64_t>* integers) {
        const char* text = node.child_value();
        Scanner in({text, std::strlen(text)}, name_);
        while (!in.at_end()) {
            double real = 0;
            std::int64_t integer = 0;
            if (reals ? !in.real(real, "a number") : !in.integer(integer, "an integer")) {
                const Error inner = in.error(); // its lines count from the array's beginning
                fail(inner.code, inner.message, node.first_child());
                error_->line += inner.line - 1;
                return false;
            }
            if (reals)
                reals->push_back(real);
            else
                integers->push_back(integer);
        }
        return true;
    }

    const std::string& name_;
    std::string_view bytes_;
    bool with_data_;
    std::size_t unpacked_ = 0; // bytes of all arrays so far
    VtkArrayFormat format_;
    pugi::xml_document document_;
    pugi::xml_node grid_;
    VtkMesh out_;
    std::optional<Error> error_;
};

} // namespace

Result<VtkMesh> parse_vtk_xml(std::string_view bytes, const std::string& name, bool with_data) {
    return VtkXmlReader(bytes, name, with_data).read();
}

} // namespace trocar::engine
