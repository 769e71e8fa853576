// The public queries of Wang, Ferguson, Schneider, Jiang, Attene, Panozzo, "A Large Scale Benchmark and an Inclusion-Based
// Algorithm for Continuous Collision Detection" (2021): eight rows a query, each coordinate a numerator and a denominator,
// and the exact answer.
#include "collision/ccd/ccd.hpp"
#include "collision/ccd/sweep.hpp"
#include "tests/collision/rational.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

namespace trocar::collision {
namespace {

struct Query {
    std::array<Vec3, 8> rows; // four points at t0, the same four at t1
    bool collides;
};

std::string read_gz(const std::filesystem::path& path) {
    std::string text;
    gzFile file = gzopen(path.c_str(), "rb");
    if (file == nullptr) return text;
    char chunk[65536];
    for (int got = 0; (got = gzread(file, chunk, sizeof chunk)) > 0;) text.append(chunk, static_cast<std::size_t>(got));
    gzclose(file);
    return text;
}

std::vector<Query> read_queries(const std::filesystem::path& path) {
    const std::string text = read_gz(path);
    std::vector<Query> queries;
    const char* at = text.c_str();
    const auto number = [&at] {
        char* end = nullptr;
        const double value = std::strtod(at, &end);
        at = *end == ',' || *end == '\n' ? end + 1 : end;
        return value;
    };
    while (*at != '\0') {
        Query query{};
        for (Vec3& row : query.rows) {
            for (int axis = 0; axis < 3; ++axis) {
                const double numerator = number(), denominator = number();
                // the files hold doubles: nothing may be lost here
                int exponent = 0;
                EXPECT_EQ(std::frexp(denominator, &exponent), 0.5) << path;
                EXPECT_LE(std::abs(numerator), 0x1p53) << path;
                row[axis] = numerator / denominator;
            }
            query.collides = number() != 0.0;
        }
        queries.push_back(query);
    }
    return queries;
}

Sweep sweep_query(const Query& q, bool vertex_face, const SweepLimits& limits) {
    const auto point = [&q](std::size_t i) { return SweptPoint{q.rows[i], q.rows[i + 4]}; };
    if (vertex_face) return sweep_vertex_face(point(0), {point(1), point(2), point(3)}, limits);
    return sweep_edge_edge({point(0), point(1)}, {point(2), point(3)}, limits);
}

bool meets(const Query& q, bool vertex_face) {
    const auto point = [&q](std::size_t i) { return SweptPoint{q.rows[i], q.rows[i + 4]}; };
    if (vertex_face) return ccd_vertex_face(point(0), {point(1), point(2), point(3)}).meets;
    return ccd_edge_edge({point(0), point(1)}, {point(2), point(3)}).meets;
}

/// As the benchmark's queries are hard: parallel edges, flat pairs, touching at a corner, a plane or an instant, a few ulps from either
/// side. Whether it collides is not known yet.
Query make_query(std::mt19937_64& random) {
    Query query{};
    const auto number = [&] {
        return std::ldexp(static_cast<double>(static_cast<int>(random() % 17) - 8), -static_cast<int>(random() % 3));
    };
    for (Vec3& row : query.rows) row = Vec3(number(), number(), number());
    auto& x = query.rows;
    const std::size_t ends = random() % 2 * 4; // at the start or at the end of the step
    switch (random() % 5) {
    case 0: // four points in one plane, at one instant
        for (std::size_t k = 0; k < 4; ++k) x[ends + k][2] = x[ends][2];
        break;
    case 1: // a point on the face's edge, or edges that meet in a point
        x[ends] = 0.5 * (x[ends + 2] + x[ends + 3]);
        break;
    case 2: // parallel edges, or a face that is a line
        x[ends + 3] = x[ends + 2] + 0.25 * (x[ends + 1] - x[ends]);
        break;
    case 3: // all of them move alike but one
        for (std::size_t k = 1; k < 4; ++k) x[k + 4] = x[k] + Vec3(0.5, -1.0, 0.25);
        break;
    default:
        break;
    }
    for (std::size_t k = random() % 3; k > 0; --k) { // some ulps to a side
        double& value = x[random() % 8][static_cast<int>(random() % 3)];
        value = std::nextafter(value, random() % 2 == 0 ? 100.0 : -100.0);
    }
    return query;
}

testing::Verdict rational_verdict(const Query& q, bool vertex_face) {
    std::array<SweptPoint, 4> points;
    for (std::size_t k = 0; k < 4; ++k) points[k] = {q.rows[k], q.rows[k + 4]};
    return testing::RationalPair(vertex_face, points).verdict();
}

TEST(CcdQueries, OfMadeNearDegenerateOnesNoneIsMissedAndExactVerdictsAreTheTruth) {
    std::mt19937_64 random(1);
    std::size_t met = 0, unknown = 0, false_positives = 0, total = 0;
    for (const bool vertex_face : {true, false})
        for (int k = 0; k < 1000; ++k) {
            Query query = make_query(random);
            const testing::Verdict truth = rational_verdict(query, vertex_face);
            unknown += truth == testing::Verdict::Unknown;
            if (truth == testing::Verdict::Unknown) continue;
            query.collides = truth == testing::Verdict::Meets;
            ++total;
            met += query.collides;
            const bool hit = sweep_query(query, vertex_face, {}).hit();
            EXPECT_TRUE(hit || !query.collides) << "query " << k << (vertex_face ? ", vertex and face" : ", edges") << " is missed";
            EXPECT_EQ(meets(query, vertex_face), query.collides) << "query " << k << (vertex_face ? ", vertex and face" : ", edges");
            false_positives += hit && !query.collides;
        }
    std::printf("%zu queries, %zu meet, %zu false positives of the conservative test, %zu not known to the rational test\n", total, met,
                false_positives, unknown);
    EXPECT_GT(met, total / 10);
    EXPECT_LT(met, total);
    EXPECT_LT(unknown, total / 20);
}

TEST(CcdQueries, NoCollisionIsMissedAndExactVerdictsAreTheTruth) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (data == nullptr) GTEST_SKIP() << "TROCAR_TEST_DATA is not set";
    const std::filesystem::path folder = std::filesystem::path(data) / "ccd_queries";
    if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << folder << " is missing";
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().string().ends_with(".csv.gz")) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::size_t total = 0, misses = 0, false_positives = 0, unresolved = 0, wrong_verdicts = 0;
    double seconds = 0.0, worst = 0.0;
    for (const auto& file : files) {
        const bool vertex_face = file.string().find("vertex-face") != std::string::npos;
        std::size_t file_positives = 0, file_queries = 0;
        for (const Query& query : read_queries(file)) {
            const auto start = std::clock();
            const Sweep sweep = sweep_query(query, vertex_face, {});
            const double spent = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
            seconds += spent;
            worst = std::max(worst, spent);
            ++total;
            ++file_queries;
            misses += query.collides && !sweep.hit();
            file_positives += !query.collides && sweep.hit();
            wrong_verdicts += meets(query, vertex_face) != query.collides;
            unresolved += sweep.outcome == SweepOutcome::Unresolved;
        }
        std::printf("%-55s %5zu queries, %zu false positives\n", file.filename().c_str(), file_queries, file_positives);
        false_positives += file_positives;
    }
    ASSERT_GT(total, 0u);
    std::printf("%zu queries: %zu missed, %zu false positives, %zu unresolved, mean %.0f ns, worst %.1f us\n", total, misses,
                false_positives, unresolved, 1e9 * seconds / static_cast<double>(total), 1e6 * worst);
    EXPECT_EQ(misses, 0u);
    EXPECT_LE(false_positives, 222u);
    EXPECT_EQ(wrong_verdicts, 0u);
}

} // namespace
} // namespace trocar::collision
