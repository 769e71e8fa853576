// The fuzz targets without a fuzzer: every seed, and a counted number of random changes to it, the same ones every day unless
// TROCAR_TEST_SEED says otherwise. tests/fuzz/run.sh drives the same targets with libFuzzer, for as long as one likes.
#include "targets.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <ostream>
#include <random>

namespace trocar::fuzz {

std::ostream& operator<<(std::ostream& os, const Target& target) { return os << target.name; } // found by gtest

namespace {

/// What breaks readers: numbers at the edge of a type, cuts, repeated pieces, pieces of another place.
std::string changed(std::string bytes, std::mt19937& random, std::size_t most) {
    static constexpr std::string_view kPieces[] = {
        "-1", "4294967295", "4000000000000",    "18446744073709551615",          "1e999",           "nan", "-0", "\n",
        "{",  "\"",         "\xff\xff\xff\xff", std::string_view("\0\0\0\0", 4), "\x7f\xff\xff\xff"};
    for (unsigned hits = 1 + random() % 4; hits > 0; --hits) {
        const std::size_t at = bytes.empty() ? 0 : random() % bytes.size();
        switch (random() % 6) {
        case 0:
            bytes.insert(at, kPieces[random() % std::size(kPieces)]);
            break;
        case 1:
            bytes.replace(at, 1 + random() % 4, kPieces[random() % std::size(kPieces)]);
            break;
        case 2:
            bytes.resize(at);
            break;
        case 3:
            bytes.insert(at, bytes.substr(random() % (bytes.size() + 1), 1 + random() % 40));
            break;
        case 4:
            bytes.erase(at, 1 + random() % 8);
            break;
        default:
            if (!bytes.empty()) bytes[at] = static_cast<char>(random());
            break;
        }
    }
    if (bytes.size() > most) bytes.resize(most);
    return bytes;
}

/// Of all seeds of a target together.
constexpr std::size_t kChanges = 1200;

class Fuzzed : public ::testing::TestWithParam<Target> {};

TEST_P(Fuzzed, BreaksNoPromise) {
    const Target& target = GetParam();
    const char* wanted = std::getenv("TROCAR_TEST_SEED");
    const unsigned long seed = wanted != nullptr ? std::strtoul(wanted, nullptr, 10) : 20261122;
    std::printf("seed %lu\n", seed);
    std::mt19937 random(static_cast<std::mt19937::result_type>(seed));
    const std::vector<std::string> seeds = seeds_of(target.name);
    ASSERT_FALSE(seeds.empty()) << "a target without a sound input sees only its first check";
    target.run("");
    for (const std::string& sound : seeds) {
        target.run(sound);
        for (std::size_t k = 0; k < kChanges / seeds.size(); ++k) target.run(changed(sound, random, target.most_bytes));
    }
}
INSTANTIATE_TEST_SUITE_P(Targets, Fuzzed, ::testing::ValuesIn(targets().begin(), targets().end()),
                         [](const auto& tested) { return std::string(tested.param.name); });

} // namespace
} // namespace trocar::fuzz
