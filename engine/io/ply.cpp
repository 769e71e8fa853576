// PLY, text and binary in both byte orders: elements and properties in any order, only x, y, z and the faces' vertex
// lists matter.
#include "engine/io/formats.hpp"
#include "engine/io/scalar.hpp"
#include "engine/io/scanner.hpp"

#include <fmt/format.h>

#include <optional>

namespace trocar::engine {
namespace {

struct Property {
    std::string name;
    ScalarType type = ScalarType::Float32; // of the value, or of a list's items
    std::optional<ScalarType> list;        // type of a list's length
};

struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
};

struct Header {
    bool text = true, big = false;
    std::vector<Element> elements;
};

class PlyReader {
public:
    PlyReader(std::string_view bytes, const std::string& name) : in_(bytes, name), name_(name) {}

    Result<TriMesh> read() {
        if (!read_header() || !read_body()) return in_.error();
        if (mesh_.triangles.empty()) return Error{ErrorCode::BadMesh, "holds no face", name_};
        return std::move(mesh_);
    }

private:
    bool read_header() {
        std::string_view word;
        if (!in_.word(word, "'ply'")) return false;
        if (word != "ply") return in_.fail(ErrorCode::BadSyntax, "does not begin with 'ply'");
        bool has_format = false;
        while (in_.word(word, "'end_header'")) {
            if (word == "end_header") {
                in_.skip_line();
                if (!has_format) return in_.fail(ErrorCode::BadSyntax, "the header names no format");
                return find_vertices();
            }
            bool good = true;
            if (word == "format")
                good = has_format = read_format();
            else if (word == "element")
                good = read_element();
            else if (word == "property")
                good = read_property();
            else if (word != "comment" && word != "obj_info")
                good = in_.fail(ErrorCode::BadSyntax, "neither element nor property nor 'end_header'");
            if (!good) return false;
            in_.skip_line();
        }
        return false;
    }

    bool read_format() {
        std::string_view word;
        if (!in_.word(word, "the format")) return false;
        header_.text = word == "ascii";
        header_.big = word == "binary_big_endian";
        return header_.text || header_.big || word == "binary_little_endian" ||
               in_.fail(ErrorCode::BadSyntax, "the format is none of ascii, binary_little_endian, binary_big_endian");
    }

    bool read_element() {
        std::string_view word;
        Element element;
        if (!in_.word(word, "the element's name") || !in_.count(element.count, "the number of elements", 0)) return false;
        element.name = word;
        header_.elements.push_back(std::move(element));
        return true;
    }

    bool read_type(ScalarType& type) {
        std::string_view word;
        if (!in_.word(word, "a type")) return false;
        const std::optional<ScalarType> found = find_scalar_type(word);
        if (!found) return in_.fail(ErrorCode::BadSyntax, fmt::format("'{}' is no type of a PLY file", word.substr(0, 40)));
        type = *found;
        return true;
    }

    bool read_property() {
        if (header_.elements.empty()) return in_.fail(ErrorCode::BadSyntax, "a property before the first element");
        Property property;
        if (in_.peek_word() == "list") {
            std::string_view word;
            ScalarType length{};
            if (!in_.word(word, "list") || !read_type(length)) return false;
            if (is_real(length)) return in_.fail(ErrorCode::BadSyntax, "a list's length must be an integer");
            property.list = length;
        }
        std::string_view name;
        if (!read_type(property.type) || !in_.word(name, "the property's name")) return false;
        property.name = name;
        header_.elements.back().properties.push_back(std::move(property));
        return true;
    }

    /// Faces may come before vertices: their number must be known first.
    bool find_vertices() {
        for (const Element& element : header_.elements) {
            if (element.name != "vertex") continue;
            // Without properties they would take no bytes, and faces would name vertices that are not stored.
            if (element.properties.empty()) return in_.fail(ErrorCode::BadSyntax, "the vertices have no x, y and z");
            if (element.count >= kNoIndex - vertex_count_)
                return in_.fail(ErrorCode::BadSyntax, "claims more vertices than indices can tell apart");
            vertex_count_ += element.count;
        }
        return true;
    }

    bool read_body() {
        in_.set_binary(!header_.text);
        for (const Element& element : header_.elements) {
            if (element.properties.empty()) continue; // takes no bytes, however many there are
            if (!in_.check_fits(element.count, least_bytes(element), "the number of elements")) return false;
            const bool good = element.name == "vertex" ? read_vertices(element)
                              : element.name == "face" ? read_faces(element)
                                                       : pass_over(element);
            if (!good) return false;
        }
        return true;
    }

    /// A row of text takes a digit and a blank per property; the very last blank may be missing, hence the - 1.
    std::size_t least_bytes(const Element& element) const {
        if (header_.text) return 2 * element.properties.size() - 1;
        std::size_t bytes = 0;
        for (const Property& property : element.properties) bytes += size_of(property.list.value_or(property.type));
        return bytes;
    }

    bool read_vertices(const Element& element) {
        std::vector<int> axes;
        unsigned seen = 0;
        for (const Property& property : element.properties) {
            const int axis = property.list || property.name.size() != 1 ? -1 : property.name[0] - 'x';
            axes.push_back(axis >= 0 && axis < 3 ? axis : -1);
            if (axes.back() >= 0) seen |= 1u << axis;
        }
        if (seen != 7) return in_.fail(ErrorCode::BadSyntax, "the vertices have no x, y and z");
        mesh_.vertices.reserve(mesh_.vertices.size() + element.count);
        for (std::size_t i = 0; i < element.count; ++i) {
            Vec3 position = Vec3::Zero();
            for (std::size_t k = 0; k < axes.size(); ++k) {
                double value = 0;
                if (!read_value(element.properties[k], value)) return false;
                if (axes[k] >= 0) position[axes[k]] = value;
            }
            if (!is_finite(position)) return in_.fail_not_finite(i);
            mesh_.vertices.push_back(position);
        }
        return true;
    }

    bool read_faces(const Element& element) {
        const Property* corners = nullptr;
        for (const Property& property : element.properties)
            if (property.list && (property.name == "vertex_indices" || property.name == "vertex_index")) corners = &property;
        if (!corners || is_real(corners->type))
            return in_.fail(ErrorCode::BadSyntax, "the faces have no list of integers called vertex_indices");
        mesh_.triangles.reserve(mesh_.triangles.size() + element.count);
        double ignored = 0;
        for (std::size_t i = 0; i < element.count; ++i) {
            for (const Property& property : element.properties) {
                if (&property != corners ? !read_value(property, ignored) : !read_corners(property)) return false;
            }
            add_fan(mesh_.triangles, corners_);
        }
        return true;
    }

    bool read_corners(const Property& property) {
        std::size_t size = 0;
        if (!read_length(property, size)) return false;
        corners_.clear();
        for (std::size_t i = 0; i < size; ++i) {
            std::int64_t id = 0;
            if (!read_integer(property.type, id)) return false;
            if (id < 0 || static_cast<std::size_t>(id) >= vertex_count_)
                return in_.fail(ErrorCode::BadMesh, fmt::format("vertex index {}, but there are {} vertices", id, vertex_count_));
            corners_.push_back(static_cast<Index>(id));
        }
        return true;
    }

    bool pass_over(const Element& element) {
        double ignored = 0;
        for (std::size_t i = 0; i < element.count; ++i)
            for (const Property& property : element.properties)
                if (!read_value(property, ignored)) return false;
        return true;
    }

    bool read_length(const Property& property, std::size_t& size) {
        std::int64_t length = 0;
        if (!read_integer(*property.list, length)) return false;
        if (length < 0) return in_.fail(ErrorCode::BadSyntax, fmt::format("a list's length is {}", length));
        size = static_cast<std::size_t>(length);
        return in_.check_fits(size, header_.text ? 1 : size_of(property.type), "a list's length");
    }

    bool read_integer(ScalarType type, std::int64_t& value) {
        if (header_.text) return in_.integer(value, "an integer");
        std::string_view bytes;
        if (!in_.raw(bytes, size_of(type), "a number")) return false;
        value = load_integer(bytes.data(), type, header_.big);
        return true;
    }

    /// A number, or a list that is passed over.
    bool read_value(const Property& property, double& value) {
        std::size_t size = 1;
        if (property.list && !read_length(property, size)) return false;
        std::string_view bytes;
        if (!header_.text) {
            if (!in_.raw(bytes, size * size_of(property.type), "numbers")) return false;
            if (!property.list) value = load_real(bytes.data(), property.type, header_.big);
            return true;
        }
        for (std::size_t i = 0; i < size; ++i)
            if (!in_.real(value, "a number")) return false;
        return true;
    }

    Scanner in_;
    const std::string& name_;
    Header header_;
    TriMesh mesh_;
    std::size_t vertex_count_ = 0; // as the header says
    std::vector<Index> corners_;
};

} // namespace

Result<TriMesh> parse_ply(std::string_view bytes, const std::string& name) { return PlyReader(bytes, name).read(); }

} // namespace trocar::engine
