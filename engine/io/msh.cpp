// Gmsh MSH: version 1 ($NOD, $ELM), 2.x and 4.1, text and binary.
#include "engine/io/formats.hpp"
#include "engine/io/node_ids.hpp"
#include "engine/io/scalar.hpp"
#include "engine/io/scanner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace trocar::engine {
namespace {

constexpr int kTriangle = 2, kTetrahedron = 4, kHexahedron = 5, kPrism = 6, kPyramid = 7; // Gmsh's element types

/// Nodes of each element type, from Gmsh's manual; 0: unknown to us.
constexpr std::size_t nodes_of_type(std::int64_t type) noexcept {
    constexpr std::array<std::uint8_t, 32> kNodes = {0, 2,  3,  4,  4, 8,  6,  5,  3,  6,  9, 10, 27, 18, 14, 1,
                                                     8, 20, 15, 13, 9, 10, 12, 15, 15, 21, 4, 5,  6,  20, 35, 56};
    return type < 0 || type >= static_cast<std::int64_t>(kNodes.size()) ? 0 : kNodes[static_cast<std::size_t>(type)];
}

class MshReader {
public:
    MshReader(std::string_view bytes, const std::string& name, BesideTets* beside) : in_(bytes, name), name_(name), beside_(beside) {}

    Result<TetMesh> read() {
        while (!in_.at_end())
            if (!read_section()) return in_.error();
        if (ids_.size() == 0) return Error{ErrorCode::BadMesh, "holds no nodes", name_};
        if (mesh_.tets.empty() && cells_.empty())
            return Error{ErrorCode::BadMesh, fmt::format("holds no linear tetrahedra, hexahedra, prisms or pyramids; {} elements of other types", others_), name_};
        keep_labels();
        return join_cells(std::move(mesh_), cells_, beside_);
    }

private:
    bool read_section() {
        std::string_view word;
        if (!in_.word(word, "a section")) return false;
        if (word.empty() || word[0] != '$') return in_.fail(ErrorCode::BadSyntax, "a section should begin here, as $Nodes");
        const std::string section(word.substr(1));
        if (section == "MeshFormat") return read_format();
        if (section == "NOD") return version_one() && read_nodes_v2() && end_section("$ENDNOD");
        if (section == "ELM") return version_one() && read_elements_v1() && end_section("$ENDELM");
        if (section == "Nodes") return has_format() && (four_ ? read_nodes_v4() : read_nodes_v2()) && end_section("$EndNodes");
        if (section == "Elements") {
            const bool good = has_format() && (four_ ? read_elements_v4() : binary_ ? read_elements_v2_binary() : read_elements_v2());
            return good && end_section("$EndElements");
        }
        if (section == "PhysicalNames" && with_arrays()) return read_physical_names() && end_section("$EndPhysicalNames");
        if (section == "Entities" && with_arrays() && four_) return read_entities() && end_section("$EndEntities");
        return pass_over(section);
    }

    [[nodiscard]] bool with_arrays() const { return beside_ != nullptr && beside_->with_arrays; }

    /// An array that is 0 throughout says nothing: Gmsh writes it where there are no groups.
    void keep_labels() {
        const auto keep = [this](const char* name, std::vector<double>& values, std::map<std::int64_t, std::string> names) {
            if (std::any_of(values.begin(), values.end(), [](double value) { return value != 0.0; }))
                beside_->arrays.push_back({name, std::move(values), std::move(names)});
        };
        if (!with_arrays()) return;
        keep("gmsh:physical", physical_of_cell_, std::move(physical_names_));
        keep("gmsh:geometrical", entity_of_cell_, {});
    }

    /// Rows of a dimension, a number and a name in quotes; text in binary files too.
    bool read_physical_names() {
        std::size_t count = 0;
        if (!in_.count(count, "the number of physical names", 4)) return false;
        for (std::size_t i = 0; i < count; ++i) {
            std::int64_t dimension = 0, tag = 0;
            if (!in_.integer(dimension, "a dimension") || !in_.integer(tag, "a physical group")) return false;
            std::string_view name = in_.rest_of_line();
            if (name.size() >= 2 && name.front() == '"' && name.back() == '"') name = name.substr(1, name.size() - 2);
            if (dimension == 3) physical_names_[tag] = std::string(name);
        }
        return true;
    }

    /// Of version 4.1, which has the physical groups of its elements here.
    bool read_entities() {
        if (binary_) in_.skip_line();
        std::array<std::size_t, 4> counts{};
        for (std::size_t dimension = 0; dimension < 4; ++dimension)
            if (!read_count(counts[dimension], "the number of entities", 8, dimension == 0 ? 36 : 60)) return false;
        for (std::size_t dimension = 0; dimension < 4; ++dimension)
            for (std::size_t i = 0; i < counts[dimension]; ++i)
                if (!read_entity(dimension)) return false;
        return true;
    }

    /// Its number, its place or box, its physical groups, and what bounds it.
    bool read_entity(std::size_t dimension) {
        std::int64_t tag = 0, number = 0;
        std::size_t groups = 0, bounds = 0;
        if (!read_int(tag, "the entity's tag") || !pass_parameters(dimension == 0 ? 3 : 6) || !read_count(groups, "the number of physical groups", 2, 4))
            return false;
        for (std::size_t i = 0; i < groups; ++i) {
            if (!read_int(number, "a physical group")) return false;
            if (dimension == 3 && i == 0) physical_of_entity_[tag] = number;
        }
        if (dimension == 0) return true;
        if (!read_count(bounds, "the number of bounding entities", 2, 4)) return false;
        for (std::size_t i = 0; i < bounds; ++i)
            if (!read_int(number, "a bounding entity")) return false;
        return true;
    }

    bool version_one() {
        has_format_ = true;
        return true;
    }
    bool has_format() { return has_format_ || in_.fail(ErrorCode::BadSyntax, "$MeshFormat should come first"); }

    bool read_format() {
        double version = 0;
        std::int64_t mode = 0, real_size = 0;
        if (!in_.real(version, "the version") || !in_.integer(mode, "the file type") || !in_.integer(real_size, "the data size"))
            return false;
        four_ = version >= 4;
        if (!(version >= 2 && version < 3) && version != 4.1)
            return in_.fail(ErrorCode::BadValue, fmt::format("version {} is not read; 1, 2.x and 4.1 are", version));
        if (real_size != 8) return in_.fail(ErrorCode::BadValue, fmt::format("data size {} is not read; 8 is", real_size));
        binary_ = mode == 1;
        has_format_ = true;
        in_.set_binary(binary_);
        if (binary_ && !read_byte_order()) return false;
        return end_section("$EndMeshFormat");
    }

    bool read_byte_order() {
        in_.skip_line();
        std::string_view one;
        if (!in_.raw(one, 4, "the byte order")) return false;
        big_ = load_integer(one.data(), ScalarType::Int32, true) == 1;
        return big_ || load_integer(one.data(), ScalarType::Int32, false) == 1 ||
               in_.fail(ErrorCode::BadSyntax, "the byte order mark is not 1");
    }

    bool end_section(std::string_view mark) {
        std::string_view word;
        if (!in_.word(word, mark.data())) return false;
        return word == mark || in_.fail(ErrorCode::BadSyntax, fmt::format("{} should stand here", mark));
    }

    /// Sections without geometry, up to their end mark.
    bool pass_over(const std::string& section) {
        const std::string mark = "$End" + section;
        std::string_view word;
        while (in_.word(word, mark.c_str())) {
            if (word == mark || word == "$END" + section) return true;
            in_.skip_line();
        }
        return false;
    }

    // Numbers, whichever way the file writes them.
    bool read_number(ScalarType type, std::int64_t& value, const char* what) {
        if (!binary_) return in_.integer(value, what);
        std::string_view bytes;
        if (!in_.raw(bytes, size_of(type), what)) return false;
        value = load_integer(bytes.data(), type, big_);
        return true;
    }
    bool read_int(std::int64_t& value, const char* what) { return read_number(ScalarType::Int32, value, what); }
    bool read_size(std::int64_t& value, const char* what) { return read_number(ScalarType::UInt64, value, what); }
    bool read_count(std::size_t& count, const char* what, std::size_t text_bytes, std::size_t binary_bytes) {
        std::int64_t value = 0;
        if (!read_size(value, what)) return false;
        if (value < 0) return in_.fail(ErrorCode::BadValue, fmt::format("{} is {}", what, value));
        count = static_cast<std::size_t>(value);
        return in_.check_fits(count, binary_ ? binary_bytes : text_bytes, what);
    }
    bool read_point(Vec3& out, std::int64_t id) {
        if (!binary_) return in_.point(out, static_cast<std::size_t>(id));
        std::string_view bytes;
        if (!in_.raw(bytes, 24, "coordinates")) return false;
        for (int axis = 0; axis < 3; ++axis) out[axis] = load_real(bytes.data() + 8 * axis, ScalarType::Float64, big_);
        return is_finite(out) || in_.fail_not_finite(static_cast<std::size_t>(id));
    }

    bool add_node(std::int64_t id, const Vec3& position) {
        if (mesh_.vertices.size() >= kNoIndex) return in_.fail(ErrorCode::BadMesh, "more nodes than indices");
        ids_.add(id);
        mesh_.vertices.push_back(position);
        return true;
    }
    bool check_ids() {
        const std::optional<std::int64_t> twice = ids_.find_duplicate();
        return !twice || in_.fail(ErrorCode::BadMesh, fmt::format("node {} is given twice", *twice));
    }
    bool first_nodes() { return ids_.size() == 0 || in_.fail(ErrorCode::BadSyntax, "a second section of nodes"); }

    /// The count is text even in binary files.
    bool read_nodes_v2() {
        std::size_t count = 0;
        if (!first_nodes() || !in_.count(count, "the number of nodes", binary_ ? 28 : 7)) return false;
        if (binary_) in_.skip_line();
        mesh_.vertices.reserve(count);
        ids_.reserve(count);
        for (std::size_t i = 0; i < count; ++i) {
            std::int64_t id = 0;
            Vec3 position;
            if (!read_int(id, "a node number") || !read_point(position, id) || !add_node(id, position)) return false;
        }
        return check_ids();
    }

    bool read_nodes_v4() {
        if (binary_) in_.skip_line();
        std::size_t blocks = 0, count = 0;
        std::int64_t ignored = 0;
        if (!first_nodes() || !read_count(blocks, "the number of blocks", 7, 20) || !read_count(count, "the number of nodes", 7, 32) ||
            !read_size(ignored, "the smallest number") || !read_size(ignored, "the largest number"))
            return false;
        for (std::size_t i = 0; i < blocks; ++i)
            if (!read_node_block()) return false;
        if (ids_.size() != count)
            return in_.fail(ErrorCode::BadSyntax, fmt::format("{} nodes are announced, the blocks hold {}", count, ids_.size()));
        return check_ids();
    }

    bool read_node_block() {
        std::int64_t dimension = 0, tag = 0, parametric = 0;
        std::size_t count = 0;
        if (!read_int(dimension, "the entity's dimension") || !read_int(tag, "the entity's tag") || !read_int(parametric, "'parametric'") ||
            !read_count(count, "the number of nodes in the block", 8, 32))
            return false;
        if (dimension < 0 || dimension > 3) return in_.fail(ErrorCode::BadValue, fmt::format("dimension {}", dimension));
        std::vector<std::int64_t> tags(count);
        for (std::int64_t& node : tags)
            if (!read_size(node, "a node number")) return false;
        for (const std::int64_t node : tags) {
            Vec3 position;
            if (!read_point(position, node) || !pass_parameters(parametric != 0 ? dimension : 0) || !add_node(node, position)) return false;
        }
        return true;
    }

    bool pass_parameters(std::int64_t how_many) {
        double ignored = 0;
        std::string_view bytes;
        if (binary_) return in_.raw(bytes, static_cast<std::size_t>(how_many) * 8, "parameters");
        for (std::int64_t i = 0; i < how_many; ++i)
            if (!in_.real(ignored, "a parameter")) return false;
        return true;
    }

    [[nodiscard]] static bool is_volume(std::int64_t type) { return type >= kTetrahedron && type <= kPyramid; }
    [[nodiscard]] bool takes(std::int64_t type) const { return is_volume(type) || (type == kTriangle && beside_ != nullptr); }

    /// The node numbers of an element that is taken, each read by read_id.
    template <class ReadId>
    bool read_element(std::int64_t type, ReadId&& read_id) {
        CellPlaces& places = cells_.places;
        if (type == kTriangle) return read_corners("triangle", beside_->faces, read_id);
        if (type == kHexahedron) return read_corners("hexahedron", cells_.hexahedra, read_id) && note_labels(places.hexahedra);
        if (type == kPrism) return read_corners("prism", cells_.prisms, read_id) && note_labels(places.prisms);
        if (type == kPyramid) return read_corners("pyramid", cells_.pyramids, read_id) && note_labels(places.pyramids);
        return read_corners("tetrahedron", mesh_.tets, read_id) && note_labels(places.tets);
    }
    bool note_labels(std::vector<std::size_t>& places) {
        if (!with_arrays()) return true;
        places.push_back(physical_of_cell_.size());
        physical_of_cell_.push_back(std::abs(static_cast<double>(physical_))); // the sign turns the cell round
        entity_of_cell_.push_back(static_cast<double>(entity_));
        return true;
    }
    template <class Element, class ReadId>
    bool read_corners(const char* what, std::vector<Element>& elements, ReadId&& read_id) {
        Element element{};
        for (Index& corner : element) {
            std::int64_t id = 0;
            if (!read_id(id)) return false;
            corner = ids_.find(id);
            if (corner == kNoIndex) return in_.fail(ErrorCode::BadMesh, fmt::format("a {} uses node {}, which is not given", what, id));
        }
        elements.push_back(element);
        return true;
    }

    /// id type physical elementary node_count nodes...
    bool read_elements_v1() {
        std::size_t count = 0;
        if (!in_.count(count, "the number of elements", 12)) return false;
        for (std::size_t i = 0; i < count; ++i) {
            std::int64_t id = 0, type = 0, size = 0;
            if (!in_.integer(id, "an element number") || !in_.integer(type, "a type") || !in_.integer(physical_, "a region") ||
                !in_.integer(entity_, "a region") || !in_.integer(size, "the number of nodes") || !read_element_line(type))
                return false;
        }
        return true;
    }

    /// id type tag_count tags... nodes...
    bool read_elements_v2() {
        std::size_t count = 0;
        if (!in_.count(count, "the number of elements", 8)) return false;
        for (std::size_t i = 0; i < count; ++i) {
            std::int64_t id = 0, type = 0, tag = 0;
            std::size_t tags = 0;
            if (!in_.integer(id, "an element number") || !in_.integer(type, "a type") || !in_.count(tags, "the number of tags", 2))
                return false;
            physical_ = entity_ = 0;
            for (std::size_t k = 0; k < tags; ++k) {
                if (!in_.integer(tag, "a tag")) return false;
                if (k < 2) (k == 0 ? physical_ : entity_) = tag;
            }
            if (!read_element_line(type)) return false;
        }
        return true;
    }

    bool read_element_line(std::int64_t type) {
        others_ += !is_volume(type);
        if (!takes(type)) {
            in_.skip_line();
            return true;
        }
        return read_element(type, [&](std::int64_t& node) { return in_.integer(node, "a node number"); });
    }

    /// Blocks of: type, how many, tag_count, then rows of id, tags, nodes; all 32-bit.
    bool read_elements_v2_binary() {
        std::size_t count = 0;
        if (!in_.count(count, "the number of elements", 8)) return false;
        in_.skip_line();
        while (count > 0) {
            std::int64_t type = 0, rows = 0, tags = 0;
            if (!read_int(type, "a type") || !read_int(rows, "a number of elements") || !read_int(tags, "a number of tags")) return false;
            const std::size_t nodes = nodes_of_type(type);
            if (nodes == 0) return in_.fail(ErrorCode::BadValue, fmt::format("element type {} is not known", type));
            if (rows <= 0 || static_cast<std::size_t>(rows) > count || tags < 0)
                return in_.fail(ErrorCode::BadSyntax,
                                fmt::format("a block of {} elements with {} tags, {} elements left", rows, tags, count));
            const std::size_t head = 4 * (1 + static_cast<std::size_t>(tags));
            if (!in_.check_fits(static_cast<std::size_t>(rows), head + 4 * nodes, "a block's number of elements")) return false;
            for (std::int64_t i = 0; i < rows; ++i)
                if (!read_binary_row(type, head, nodes, ScalarType::Int32)) return false;
            count -= static_cast<std::size_t>(rows);
        }
        return true;
    }

    bool read_binary_row(std::int64_t type, std::size_t head, std::size_t nodes, ScalarType id_type) {
        std::string_view row;
        const std::size_t width = size_of(id_type);
        if (!in_.raw(row, head + width * nodes, "an element")) return false;
        if (id_type == ScalarType::Int32) { // with its tags
            physical_ = head > 4 ? load_integer(row.data() + 4, id_type, big_) : 0;
            entity_ = head > 8 ? load_integer(row.data() + 8, id_type, big_) : 0;
        }
        others_ += !is_volume(type);
        if (!takes(type)) return true;
        const char* at = row.data() + head;
        return read_element(type, [&](std::int64_t& node) {
            node = load_integer(at, id_type, big_);
            at += width;
            return true;
        });
    }

    bool read_elements_v4() {
        if (binary_) in_.skip_line();
        std::size_t blocks = 0, count = 0, read = 0;
        std::int64_t ignored = 0;
        if (!read_count(blocks, "the number of blocks", 7, 20) || !read_count(count, "the number of elements", 4, 16) ||
            !read_size(ignored, "the smallest number") || !read_size(ignored, "the largest number"))
            return false;
        for (std::size_t i = 0; i < blocks; ++i) {
            std::int64_t dimension = 0, type = 0;
            std::size_t rows = 0;
            if (!read_int(dimension, "the entity's dimension") || !read_int(entity_, "the entity's tag") || !read_int(type, "a type") ||
                !read_count(rows, "the number of elements in the block", 4, 16))
                return false;
            const auto group = physical_of_entity_.find(entity_);
            physical_ = dimension == 3 && group != physical_of_entity_.end() ? group->second : 0;
            if (!read_element_block(type, rows)) return false;
            read += rows;
        }
        return read == count || in_.fail(ErrorCode::BadSyntax, fmt::format("{} elements are announced, the blocks hold {}", count, read));
    }

    bool read_element_block(std::int64_t type, std::size_t rows) {
        const std::size_t nodes = nodes_of_type(type);
        if (binary_ && nodes == 0) return in_.fail(ErrorCode::BadValue, fmt::format("element type {} is not known", type));
        for (std::size_t i = 0; i < rows; ++i) {
            std::int64_t id = 0;
            if (binary_ ? !read_binary_row(type, 8, nodes, ScalarType::UInt64)
                        : !in_.integer(id, "an element number") || !read_element_line(type))
                return false;
        }
        return true;
    }

    Scanner in_;
    const std::string& name_;
    TetMesh mesh_;
    MixedCells cells_;
    BesideTets* beside_; // null: not asked for
    NodeIds ids_;
    std::size_t others_ = 0; // elements that are none of these
    std::int64_t physical_ = 0, entity_ = 0;                    // of the element that is being read; 0: in none
    std::vector<double> physical_of_cell_, entity_of_cell_;     // where arrays are asked for
    std::map<std::int64_t, std::int64_t> physical_of_entity_;   // volumes of version 4.1: the first group of each
    std::map<std::int64_t, std::string> physical_names_;        // of groups of volumes
    bool has_format_ = false, four_ = false, binary_ = false, big_ = false;
};

} // namespace

Result<TetMesh> parse_msh(std::string_view bytes, const std::string& name, BesideTets* beside) {
    return MshReader(bytes, name, beside).read();
}

} // namespace trocar::engine
