// A patient with the defects of a scan, under the names that tests/scenes/real_anatomy.json asks the test data for: a liver with holes, and
// arteries as a soup of triangles in named groups, with a loose piece beside them. y points to the head, coordinates in m.
#pragma once

#include "tests/made/surfaces.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <span>

namespace trocar::made {

/// groups  of as many triangles each, in order
inline void write_obj_groups(const std::filesystem::path& file, const TriMesh& mesh, std::span<const char* const> groups) {
    std::filesystem::create_directories(file.parent_path());
    std::ofstream out(file);
    char line[128];
    for (const Vec3& v : mesh.vertices) {
        std::snprintf(line, sizeof line, "v %.9f %.9f %.9f\n", v[0], v[1], v[2]);
        out << line;
    }
    const std::size_t share = groups.empty() ? 0 : mesh.triangles.size() / groups.size() + 1;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (share > 0 && t % share == 0) out << "g " << groups[t / share] << '\n';
        out << "f " << mesh.triangles[t][0] + 1 << ' ' << mesh.triangles[t][1] + 1 << ' ' << mesh.triangles[t][2] + 1 << '\n';
    }
}

/// An aorta from below the scene's entry to above its target, with two branches towards the liver.
inline TriMesh make_abdominal_arteries() {
    const std::vector<anatomy::VesselBranch> branches{
        {{{0.008, 0.13, -0.008}, {0.013, 0.17, -0.0126}, {0.016, 0.22, -0.02}, {0.0121, 0.28, -0.024}, {0.011, 0.32, -0.026}},
         {9e-3, 9e-3, 8.5e-3, 8e-3, 8e-3}},
        {{{0.014, 0.255, -0.022}, {0.0, 0.265, 0.0}, {-0.03, 0.27, 0.01}}, {4e-3, 3.5e-3, 3e-3}},
        {{{0.016, 0.22, -0.02}, {0.04, 0.23, 0.0}, {0.06, 0.25, 0.01}}, {4e-3, 3.5e-3, 3e-3}}};
    auto mesh = anatomy::make_vessels(branches, 2e-3, 16000);
    EXPECT_TRUE(mesh.ok()) << mesh.error().to_string();
    return mesh.ok() ? std::move(*mesh) : TriMesh{};
}

inline void write_patient(const std::filesystem::path& folder, std::uint64_t seed) {
    Random random(seed);
    TriMesh liver = with_holes(make_organ(seed, 4), 6, random);
    for (Vec3& v : liver.vertices) v += Vec3(-0.06, 0.27, 0.03);
    write_obj_groups(folder / "organs/hra_vhf_liver_capsule_30k.obj.gz", as_soup(liver, random), {});
    TriMesh loose = anatomy::make_icosphere(Vec3(0.1, 0.3, 0.05), 4e-3, 1);
    const TriMesh arteries = as_soup(join(with_holes(make_abdominal_arteries(), 4, random), loose), random);
    constexpr const char* kGroups[] = {"VHF_celiac_artery", "VHF_splenic_artery", "VHF_descending_aorta_a", "VHF_descending_aorta_b"};
    write_obj_groups(folder / "vessels/hra_vhf_arteries_101k.obj.gz", arteries, kGroups);
}

} // namespace trocar::made
