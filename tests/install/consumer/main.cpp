// An external program: writes a surface, reads it back and inspects it, through the installed package.
#include <trocar.hpp>

#include <cstdio>
#include <filesystem>

int main(int argc, char** argv) {
    using namespace trocar;
    if (argc != 2) return 2;
    const TriMesh tetrahedron{.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                              .triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
    const std::filesystem::path path = std::filesystem::path(argv[1]) / "tetrahedron.vtp";
    if (const Result<void> written = engine::write_vtp(path, tetrahedron); !written) {
        std::fprintf(stderr, "%s\n", written.error().to_string().c_str());
        return 1;
    }
    const Result<TriMesh> mesh = engine::read_surface(path);
    if (!mesh) {
        std::fprintf(stderr, "%s\n", mesh.error().to_string().c_str());
        return 1;
    }
    const SurfaceReport report = inspect_surface(*mesh);
    std::printf("%zu triangles, %s\n", report.triangles, report.closed() ? "closed" : "open");
    return report.closed() ? 0 : 1;
}
