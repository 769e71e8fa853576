// Two small text formats: TetGen's .node and .ele, Vega's .veg.
#include "engine/io/formats.hpp"
#include "engine/io/node_ids.hpp"
#include "engine/io/scanner.hpp"

#include <fmt/format.h>

#include <optional>
#include <tuple>

namespace trocar::engine {
namespace {

bool read_node(Scanner& in, TetMesh& mesh, NodeIds& ids) {
    std::int64_t id = 0;
    Vec3 position;
    if (!in.integer(id, "a node number") || !in.point(position, static_cast<std::size_t>(id))) return false;
    if (mesh.vertices.size() >= kNoIndex) return in.fail(ErrorCode::BadMesh, "more nodes than indices");
    ids.add(id);
    mesh.vertices.push_back(position);
    in.skip_line(); // attributes and boundary marks
    return true;
}

bool check_ids(Scanner& in, NodeIds& ids) {
    const std::optional<std::int64_t> twice = ids.find_duplicate();
    return !twice || in.fail(ErrorCode::BadMesh, fmt::format("node {} is given twice", *twice));
}

/// id and the corners; further nodes of the line (second order) are passed over with it.
template <class Cell>
bool read_cell(Scanner& in, std::vector<Cell>& cells, const NodeIds& ids) {
    std::int64_t id = 0;
    if (!in.integer(id, "an element number")) return false;
    Cell cell{};
    for (Index& corner : cell) {
        if (!in.integer(id, "a node number")) return false;
        corner = ids.find(id);
        if (corner == kNoIndex) return in.fail(ErrorCode::BadMesh, fmt::format("node {} is not given", id));
    }
    cells.push_back(cell);
    in.skip_line();
    return true;
}

bool read_nodes(Scanner& in, TetMesh& mesh, NodeIds& ids) {
    std::size_t count = 0;
    std::int64_t dimension = 0;
    if (!in.count(count, "the number of nodes", 7) || !in.integer(dimension, "the dimension")) return false;
    if (dimension != 3) return in.fail(ErrorCode::BadValue, fmt::format("dimension {} is not read; 3 is", dimension));
    in.skip_line();
    for (std::size_t i = 0; i < count; ++i)
        if (!read_node(in, mesh, ids)) return false;
    return check_ids(in, ids);
}

template <class Cell>
bool read_elements(Scanner& in, std::vector<Cell>& cells, const NodeIds& ids) {
    constexpr std::size_t kCorners = std::tuple_size_v<Cell>;
    std::size_t count = 0;
    std::int64_t corners = 0;
    if (!in.count(count, "the number of elements", 1 + 2 * kCorners) || !in.integer(corners, "the number of nodes per element")) return false;
    if (corners != static_cast<std::int64_t>(kCorners))
        return in.fail(ErrorCode::BadValue, fmt::format("elements with {} nodes are not read; expected {}", corners, kCorners));
    in.skip_line();
    for (std::size_t i = 0; i < count; ++i)
        if (!read_cell(in, cells, ids)) return false;
    return true;
}

class VegReader {
public:
    VegReader(std::string_view bytes, const std::string& name) : in_(bytes, name), name_(name) { in_.set_comment('#'); }

    Result<TetMesh> read(BesideTets* beside) {
        while (!in_.at_end())
            if (!read_section()) return in_.error();
        if (mesh_.tets.empty() && cells_.empty()) return Error{ErrorCode::BadMesh, "holds no tetrahedra or cubes", name_};
        return join_cells(std::move(mesh_), cells_, beside);
    }

private:
    bool read_section() {
        std::string_view word;
        if (!in_.word(word, "a section")) return false;
        if (word == "*VERTICES")
            return ids_.size() == 0 ? read_nodes(in_, mesh_, ids_) : in_.fail(ErrorCode::BadSyntax, "a second *VERTICES");
        if (word == "*ELEMENTS") {
            if (!in_.word(word, "TET or CUBIC")) return false;
            if (word == "TET" || word == "TETS") return read_elements(in_, mesh_.tets, ids_);
            if (word == "CUBIC") return read_elements(in_, cells_.hexahedra, ids_);
            return in_.fail(ErrorCode::BadValue, "only elements of type TET and CUBIC are read");
        }
        if (word[0] != '*') return in_.fail(ErrorCode::BadSyntax, "a section should begin here, as *VERTICES");
        in_.skip_line();
        while (!in_.at_end() && !in_.peek_word().starts_with('*')) in_.skip_line(); // materials, sets, regions
        return true;
    }

    Scanner in_;
    const std::string& name_;
    TetMesh mesh_;
    MixedCells cells_;
    NodeIds ids_;
};

} // namespace

Result<TetMesh> parse_tetgen(std::string_view node_bytes, const std::string& node_name, std::string_view ele_bytes,
                             const std::string& ele_name) {
    TetMesh mesh;
    NodeIds ids;
    Scanner nodes(node_bytes, node_name);
    nodes.set_comment('#');
    if (!read_nodes(nodes, mesh, ids)) return nodes.error();
    Scanner elements(ele_bytes, ele_name);
    elements.set_comment('#');
    if (!read_elements(elements, mesh.tets, ids)) return elements.error();
    if (mesh.tets.empty()) return Error{ErrorCode::BadMesh, "holds no tetrahedra", ele_name};
    return join_cells(std::move(mesh), {}, nullptr);
}

Result<TetMesh> parse_veg(std::string_view bytes, const std::string& name, BesideTets* beside) { return VegReader(bytes, name).read(beside); }

} // namespace trocar::engine
