// Cell arrays of a volume file: numbers that it gives its cells, one each, such as the region that a cell belongs to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace trocar::engine {

/// Formats whose labels have no name of their own have them as meshio names them: gmsh:physical, gmsh:geometrical, medit:ref, tetgen:ref;
/// vega:region counts a .veg file's regions from 1.
struct CellArray {
    std::string name;
    std::vector<double> values;                // by the cell's place in the file; not checked against the number of cells
    std::map<std::int64_t, std::string> names; // of values, where the file names them
};

/// Where the values of each cell stand in the arrays; as many as there are cells of the kind, or none.
struct CellPlaces {
    std::vector<std::size_t> tets, hexahedra, prisms, pyramids;
};

} // namespace trocar::engine
