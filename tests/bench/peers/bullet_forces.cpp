// Bullet's neo-Hookean forces on a mesh of ours: what one evaluation costs. Float, elastic part only, one thread.
// bullet_forces MESH EVALUATIONS     prints one JSON object
// MESH: uint64 nodes, uint64 tets, double xyz[nodes], uint32 abcd[tets], as the machine writes them.
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>
#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

namespace {

struct Mesh {
    std::vector<double> position;
    std::vector<std::uint32_t> tets;
};

bool read_mesh(const char* name, Mesh& mesh) {
    std::FILE* file = std::fopen(name, "rb");
    if (file == nullptr) return false;
    std::uint64_t counts[2] = {0, 0};
    bool fine = std::fread(counts, sizeof counts, 1, file) == 1 && counts[0] < 100'000'000 && counts[1] < 100'000'000;
    if (fine) {
        mesh.position.resize(3 * counts[0]);
        mesh.tets.resize(4 * counts[1]);
        fine = std::fread(mesh.position.data(), sizeof(double), mesh.position.size(), file) == mesh.position.size() &&
               std::fread(mesh.tets.data(), sizeof(std::uint32_t), mesh.tets.size(), file) == mesh.tets.size();
    }
    std::fclose(file);
    return fine;
}

double cpu_seconds() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Every node a few per mille off its rest place, so that no tet is special.
void deform(btSoftBody& body) {
    std::uint32_t seed = 7;
    for (int i = 0; i < body.m_nodes.size(); ++i) {
        btVector3 shift;
        for (int axis = 0; axis < 3; ++axis) {
            seed = seed * 1664525u + 1013904223u;
            shift[axis] = btScalar(1e-4) * (btScalar(seed >> 8) / btScalar(1 << 23) - btScalar(1));
        }
        body.m_nodes[i].m_q = body.m_nodes[i].m_x += shift;
    }
}

} // namespace

int main(int argc, char** argv) {
    Mesh mesh;
    if (argc != 3 || !read_mesh(argv[1], mesh)) {
        std::fprintf(stderr, "usage: bullet_forces MESH EVALUATIONS\n");
        return 2;
    }
    const int evaluations = std::max(1, std::atoi(argv[2]));
    const int nodes = static_cast<int>(mesh.position.size() / 3), tets = static_cast<int>(mesh.tets.size() / 4);
    btSoftBodyWorldInfo world;
    std::vector<btVector3> start;
    for (int i = 0; i < nodes; ++i)
        start.emplace_back(btScalar(mesh.position[3 * i]), btScalar(mesh.position[3 * i + 1]), btScalar(mesh.position[3 * i + 2]));
    const std::vector<btScalar> mass(start.size(), btScalar(1e-3));
    btSoftBody body(&world, nodes, start.data(), mass.data());
    for (int i = 0; i < nodes; ++i) body.m_nodes[i].index = i;
    for (int t = 0; t < tets; ++t)
        body.appendTetra(int(mesh.tets[4 * t]), int(mesh.tets[4 * t + 1]), int(mesh.tets[4 * t + 2]), int(mesh.tets[4 * t + 3]));
    body.initializeDmInverse();
    body.m_tetraScratches.resize(tets);
    body.m_tetraScratchesTn.resize(tets);
    deform(body);
    const btScalar young = 20000, nu = btScalar(0.45);
    btDeformableNeoHookeanForce elastic(young / (2 * (1 + nu)), young * nu / ((1 + nu) * (1 - 2 * nu)));
    elastic.addSoftBody(&body);
    btAlignedObjectArray<btVector3> force;
    force.resize(nodes);
    std::vector<double> seconds;
    double checksum = 0;
    for (int k = 0; k < evaluations + 1; ++k) { // the first warms up
        for (int i = 0; i < nodes; ++i) force[i].setZero();
        const double begin = cpu_seconds();
        body.updateDeformation();
        elastic.addScaledElasticForce(1, force);
        if (k > 0) seconds.push_back(cpu_seconds() - begin);
        checksum += static_cast<double>(force[nodes / 2].length());
    }
    std::sort(seconds.begin(), seconds.end());
    std::printf("{\"tets\": %d, \"ns_per_tet\": %.6g, \"ns_per_tet_best\": %.6g, \"precision\": \"%s\", \"checksum\": %.6g}\n", tets,
                1e9 * seconds[seconds.size() / 2] / tets, 1e9 * seconds.front() / tets, sizeof(btScalar) == 4 ? "float" : "double",
                checksum);
    return 0;
}
