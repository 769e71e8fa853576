#include "engine/scene/patient_sides.hpp"

#include <algorithm>
#include <array>

namespace trocar::engine {

namespace {

constexpr double kSecondLetter = 0.35; // least share of a direction that gets a second letter
constexpr double kTie = 1e-6;

} // namespace

std::string side_letters(const Vec3& direction) {
    struct Share {
        char letter;
        double share;
    };
    std::array<Share, 6> sides{{{'R', direction.x()}, {'L', -direction.x()}, {'A', direction.y()}, {'P', -direction.y()}, {'H', direction.z()}, {'F', -direction.z()}}};
    std::stable_sort(sides.begin(), sides.end(), [](const Share& a, const Share& b) { return a.share > b.share + kTie; });
    std::string letters(1, sides[0].letter);
    if (sides[1].share > kSecondLetter) letters += sides[1].letter;
    return letters;
}

} // namespace trocar::engine
