// Everything that is made once of one surface: coarse model, links, sphere tree, chromatic sets, with the quality of each.
#pragma once

#include "base/repair.hpp"
#include "base/topology.hpp"
#include "fem/tissue/material.hpp"
#include "spheretree/build/adopt_tree.hpp"
#include "spheretree/build/tree_quality.hpp"
#include "spheretree/build/wrapped_tree.hpp"

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

struct PrepareOptions {
    double unit = 1.0;           // m, of the file's coordinates
    std::vector<Repair> repairs; // in this order
    RepairOptions repairing{.may_remove_key = "--may-remove", .may_split_key = "--may-split"};
    spheretree::WrappedOptions spheres;
    std::filesystem::path spheres_file; // .sph, in the mesh's unit: taken instead of building a tree; empty: built
    std::size_t coarse_triangles = 800; // of the simplified surface that is meshed
    fem::Material material;             // the stable step depends on it
    bool use_cache = true;
};

struct MeshPreparation {
    TriMesh surface; // m, repaired
    SurfaceReport dense;
    std::size_t self_intersections = 0; // counted where the builder takes crossing triangles
    bool crossings_known = true;        // false: the search for them gave up, a note says so
    struct Coarse {
        std::size_t nodes = 0, tets = 0;
        std::string mesher;
        double min_dihedral_deg = 0.0;
        double stable_step_s = 0.0; // of RK4, at rest
        double volume_ratio = 0.0;  // to the surface's
    };
    struct Links {
        std::size_t count = 0, degenerate = 0;
        double max_length_m = 0.0;
    };
    std::optional<Coarse> coarse;  // by TetGen; none for an open surface, or where it cannot do it: see notes
    std::optional<Coarse> lattice; // the same body from a lattice of about as many nodes, for comparison
    std::optional<Links> links;
    spheretree::SphereTree spheres;
    spheretree::TreeQuality quality;
    std::optional<spheretree::Coverage> coverage; // of a tree from a file, as it came
    double sphere_seconds = 0.0, sphere_peak_mb = 0.0;        // building alone; the process's largest memory at that time
    bool spheres_from_cache = false, spheres_coarser = false; // the second as WrappedTree::coarser, with a note
    std::size_t colours = 0;
    double colour_seconds = 0.0;
    std::vector<std::string> notes; // repairs with counts; what could not be made and why
};

/// fails  the reader's own error; BadMesh with the first bad triangles and the repair or the builder that would accept it
[[nodiscard]] Result<MeshPreparation> prepare_mesh(const std::filesystem::path& file, const PrepareOptions& options,
                                                   const std::function<void(const std::string&)>& progress);

/// The contents of prepare.json. Errors of the spheres are in 1/1000 of the longest box edge.
[[nodiscard]] std::string preparation_json(const MeshPreparation& made, const PrepareOptions& options);

} // namespace trocar::engine
