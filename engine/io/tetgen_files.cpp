// Two small text formats: TetGen's .node and .ele, Vega's .veg.
#include "engine/io/formats.hpp"
#include "engine/io/node_ids.hpp"
#include "engine/io/scanner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

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

/// Numbers of the elements, and their first attribute where that is asked for.
struct ElementRows {
    NodeIds ids;
    std::vector<double>* attributes = nullptr;
};

/// id, the corners, attributes.
template <class Cell>
bool read_cell(Scanner& in, std::vector<Cell>& cells, const NodeIds& ids, bool has_attribute, ElementRows& rows) {
    std::int64_t id = 0;
    if (!in.integer(id, "an element number")) return false;
    rows.ids.add(id);
    Cell cell{};
    for (Index& corner : cell) {
        if (!in.integer(id, "a node number")) return false;
        corner = ids.find(id);
        if (corner == kNoIndex) return in.fail(ErrorCode::BadMesh, fmt::format("node {} is not given", id));
    }
    cells.push_back(cell);
    if (has_attribute) {
        if (in.at_line_end()) return in.fail(ErrorCode::BadSyntax, "the element's attribute is missing");
        if (!in.real(rows.attributes->emplace_back(), "an attribute")) return false;
    }
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
bool read_elements(Scanner& in, std::vector<Cell>& cells, const NodeIds& ids, ElementRows& rows) {
    constexpr std::size_t kCorners = std::tuple_size_v<Cell>;
    std::size_t count = 0;
    std::int64_t corners = 0, attributes = 0;
    if (!in.count(count, "the number of elements", 1 + 2 * kCorners) || !in.integer(corners, "the number of nodes per element")) return false;
    if (corners != static_cast<std::int64_t>(kCorners))
        return in.fail(ErrorCode::BadValue, fmt::format("elements with {} nodes are not read; expected {}", corners, kCorners));
    if (rows.attributes != nullptr && !in.at_line_end() && !in.integer(attributes, "the number of attributes")) return false;
    in.skip_line();
    for (std::size_t i = 0; i < count; ++i)
        if (!read_cell(in, cells, ids, attributes > 0, rows)) return false;
    return true;
}

class VegReader {
public:
    VegReader(std::string_view bytes, const std::string& name) : in_(bytes, name), name_(name) { in_.set_comment('#'); }

    Result<TetMesh> read(BesideTets* beside) {
        while (!in_.at_end())
            if (!read_section()) return in_.error();
        if (mesh_.tets.empty() && cells_.empty()) return Error{ErrorCode::BadMesh, "holds no tetrahedra or cubes", name_};
        if (beside != nullptr && beside->with_arrays && !keep_regions(*beside)) return in_.error();
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
            if (word == "TET" || word == "TETS") return read_elements(in_, mesh_.tets, ids_, elements_);
            if (word == "CUBIC") return read_elements(in_, cells_.hexahedra, ids_, elements_);
            return in_.fail(ErrorCode::BadValue, "only elements of type TET and CUBIC are read");
        }
        if (word[0] != '*') return in_.fail(ErrorCode::BadSyntax, "a section should begin here, as *VERTICES");
        const std::string name(in_.rest_of_line());
        if (word == "*SET") sets_.push_back({name, {}});
        while (!in_.at_end() && !in_.peek_word().starts_with('*')) { // materials, sets, regions
            const std::size_t position = in_.position();
            const std::string_view line = in_.rest_of_line();
            if (word == "*SET") sets_.back().lines.push_back({position, line});
            if (word == "*REGION") regions_.emplace_back(trimmed(line.substr(0, line.find(','))));
        }
        return true;
    }

    static std::string_view trimmed(std::string_view text) {
        const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
        while (!text.empty() && blank(text.front())) text.remove_prefix(1);
        while (!text.empty() && blank(text.back())) text.remove_suffix(1);
        return text;
    }

    /// A region is a set of elements, or all of them; a later one takes its elements from those before it. They count from 1, 0 is none.
    bool keep_regions(BesideTets& beside) {
        if (elements_.ids.find_duplicate() || (!mesh_.tets.empty() && !cells_.hexahedra.empty())) return true; // sets would not say which they mean
        CellArray array{"vega:region", std::vector<double>(elements_.ids.size(), 0.0), {}};
        for (std::size_t k = 0; k < regions_.size(); ++k) {
            const auto label = static_cast<std::int64_t>(k + 1);
            array.names[label] = regions_[k];
            const auto set = std::find_if(sets_.begin(), sets_.end(), [&](const Set& each) { return each.name == regions_[k]; });
            if (set != sets_.end()) {
                if (!label_set(*set, static_cast<double>(label), array.values)) return false;
            } else if (regions_[k] == "allElements")
                array.values.assign(array.values.size(), static_cast<double>(label));
        }
        for (std::size_t t = 0; t < mesh_.tets.size(); ++t) cells_.places.tets.push_back(t);
        for (std::size_t c = 0; c < cells_.hexahedra.size(); ++c) cells_.places.hexahedra.push_back(c);
        beside.arrays.push_back(std::move(array));
        return true;
    }

    struct Set {
        std::string name;
        std::vector<std::pair<std::size_t, std::string_view>> lines; // where in the file, numbers with commas between them
    };
    bool label_set(const Set& set, double label, std::vector<double>& values) {
        for (auto [position, line] : set.lines)
            while (!line.empty()) {
                const std::size_t comma = std::min(line.find(','), line.size());
                const std::string number(trimmed(line.substr(0, comma)));
                line.remove_prefix(std::min(comma + 1, line.size()));
                if (number.empty()) continue;
                Scanner in(number, name_);
                std::int64_t id = 0;
                const Index element = in.integer(id, "an element number") && in.at_end() ? elements_.ids.find(id) : kNoIndex;
                if (element == kNoIndex)
                    return in_.fail_at(position, ErrorCode::BadMesh, fmt::format("the set {:.40} names the element '{:.20}', which is not given", set.name, number));
                values[element] = label;
            }
        return true;
    }

    Scanner in_;
    const std::string& name_;
    TetMesh mesh_;
    MixedCells cells_;
    NodeIds ids_;
    ElementRows elements_;
    std::vector<Set> sets_;
    std::vector<std::string> regions_; // names of their sets
};

} // namespace

Result<TetMesh> parse_tetgen(std::string_view node_bytes, const std::string& node_name, std::string_view ele_bytes,
                             const std::string& ele_name, BesideTets* beside) {
    TetMesh mesh;
    NodeIds ids;
    Scanner nodes(node_bytes, node_name);
    nodes.set_comment('#');
    if (!read_nodes(nodes, mesh, ids)) return nodes.error();
    Scanner elements(ele_bytes, ele_name);
    elements.set_comment('#');
    std::vector<double> attributes;
    ElementRows rows;
    if (beside != nullptr && beside->with_arrays) rows.attributes = &attributes;
    if (!read_elements(elements, mesh.tets, ids, rows)) return elements.error();
    if (mesh.tets.empty()) return Error{ErrorCode::BadMesh, "holds no tetrahedra", ele_name};
    MixedCells none;
    for (std::size_t t = 0; t < attributes.size(); ++t) none.places.tets.push_back(t);
    if (!attributes.empty()) beside->arrays.push_back({"tetgen:ref", std::move(attributes), {}});
    return join_cells(std::move(mesh), none, beside);
}

Result<TetMesh> parse_veg(std::string_view bytes, const std::string& name, BesideTets* beside) { return VegReader(bytes, name).read(beside); }

} // namespace trocar::engine
