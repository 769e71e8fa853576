// MEDIT .mesh (INRIA, TetGen, libigl), text only.
#include "engine/io/formats.hpp"
#include "engine/io/scanner.hpp"
#include "engine/io/shown.hpp"

#include <fmt/format.h>

#include <array>

namespace trocar::engine {
namespace {

/// Sections whose rows are numbers only, and how many of them a row has; all but vertices, cells, and triangles where they are asked for,
/// are passed over.
struct Section {
    std::string_view name;
    std::size_t numbers;
};
constexpr std::array kSections = {
    Section{"Vertices", 4},       Section{"Tetrahedra", 5},        Section{"Triangles", 4}, Section{"Edges", 3},
    Section{"Quadrilaterals", 5}, Section{"Hexahedra", 9},         Section{"Hexaedra", 9},  Section{"Prisms", 7},
    Section{"Pyramids", 6},       Section{"Corners", 1},           Section{"Ridges", 1},    Section{"RequiredVertices", 1},
    Section{"RequiredEdges", 1},  Section{"RequiredTriangles", 1}, Section{"Normals", 3},   Section{"NormalAtVertices", 2},
    Section{"Tangents", 3},       Section{"TangentAtVertices", 2}};

class MeditReader {
public:
    MeditReader(std::string_view bytes, const std::string& name, BesideTets* beside) : in_(bytes, name), name_(name), beside_(beside) {
        in_.set_comment('#');
    }

    Result<TetMesh> read() {
        bool more = true;
        while (more && !in_.at_end())
            if (!read_section(more)) return in_.error();
        if (mesh_.tets.empty() && cells_.empty()) return Error{ErrorCode::BadMesh, "holds no tetrahedra, hexahedra, prisms or pyramids", name_};
        if (largest_ > static_cast<std::int64_t>(mesh_.vertices.size())) {
            in_.fail_at(largest_position_, ErrorCode::BadMesh,
                        fmt::format("vertex {}, but there are {} vertices", largest_, mesh_.vertices.size()));
            return in_.error();
        }
        if (with_arrays()) beside_->arrays.push_back({"medit:ref", std::move(references_), {}});
        return join_cells(std::move(mesh_), cells_, beside_);
    }

private:
    bool read_section(bool& more) {
        std::string_view word;
        std::int64_t value = 0;
        if (!in_.word(word, "a section")) return false;
        if (word == "MeshVersionFormatted") return in_.integer(value, "the version");
        if (word == "Dimension") {
            if (!in_.integer(value, "the dimension")) return false;
            return value == 3 || in_.fail(ErrorCode::BadValue, fmt::format("dimension {} is not read; 3 is", value));
        }
        if (word == "End") return more = false, true;
        for (const Section& section : kSections)
            if (word == section.name) return read_rows(section);
        return in_.fail(ErrorCode::BadSyntax, fmt::format("'{}' is no section of a .mesh file", shown(word)));
    }

    bool read_rows(const Section& section) {
        std::size_t count = 0;
        if (!in_.count(count, "the number of rows", 2 * section.numbers - 1)) return false;
        if (count >= kNoIndex) return in_.fail(ErrorCode::BadMesh, "more rows than indices");
        std::int64_t reference = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const bool good = section.name == "Vertices"                                     ? read_vertex(i)
                              : section.name == "Tetrahedra"                                 ? read_cell(mesh_.tets, cells_.places.tets)
                              : section.name == "Hexahedra" || section.name == "Hexaedra"    ? read_cell(cells_.hexahedra, cells_.places.hexahedra)
                              : section.name == "Prisms"                                     ? read_cell(cells_.prisms, cells_.places.prisms)
                              : section.name == "Pyramids"                                   ? read_cell(cells_.pyramids, cells_.places.pyramids)
                              : section.name == "Triangles" && beside_ != nullptr            ? read_element(beside_->faces, reference)
                                                                                             : pass_over(section);
            if (!good) return false;
        }
        return true;
    }

    bool read_vertex(std::size_t index) {
        Vec3 position;
        double reference = 0;
        if (!in_.point(position, index + 1) || !in_.real(reference, "a reference")) return false;
        mesh_.vertices.push_back(position);
        return true;
    }

    [[nodiscard]] bool with_arrays() const { return beside_ != nullptr && beside_->with_arrays; }

    template <class Cell>
    bool read_cell(std::vector<Cell>& cells, std::vector<std::size_t>& places) {
        std::int64_t reference = 0;
        if (!read_element(cells, reference)) return false;
        if (!with_arrays()) return true;
        places.push_back(references_.size());
        references_.push_back(static_cast<double>(reference));
        return true;
    }

    template <class Element>
    bool read_element(std::vector<Element>& elements, std::int64_t& reference) {
        Element element{};
        std::int64_t id = 0;
        for (Index& corner : element) {
            if (!in_.integer(id, "a vertex number")) return false;
            if (id < 1 || id >= static_cast<std::int64_t>(kNoIndex)) return in_.fail(ErrorCode::BadMesh, fmt::format("vertex {}", id));
            corner = static_cast<Index>(id - 1);
            if (id > largest_) {
                largest_ = id;
                largest_position_ = in_.token_position();
            }
        }
        elements.push_back(element);
        return in_.integer(reference, "a reference");
    }

    bool pass_over(const Section& section) {
        double ignored = 0;
        for (std::size_t i = 0; i < section.numbers; ++i)
            if (!in_.real(ignored, "a number")) return false;
        return true;
    }

    Scanner in_;
    const std::string& name_;
    TetMesh mesh_;
    MixedCells cells_;
    BesideTets* beside_; // null: not asked for
    std::vector<double> references_; // of the cells, where they are asked for
    std::int64_t largest_ = 0; // vertex number in use
    std::size_t largest_position_ = 0;
};

} // namespace

Result<TetMesh> parse_medit(std::string_view bytes, const std::string& name, BesideTets* beside) {
    return MeditReader(bytes, name, beside).read();
}

} // namespace trocar::engine
