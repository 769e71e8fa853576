#include "engine/scene/patient_sides.hpp"

#include <array>
#include <utility>

namespace trocar::engine {

namespace {

constexpr double kSecondLetter = 0.35; // least share of a direction that gets a second letter
constexpr double kTie = 1e-6;

} // namespace

std::string side_letters(const Vec3& direction) {
    std::array<std::pair<char, double>, 6> sides{{{'R', direction.x()}, {'L', -direction.x()}, {'A', direction.y()}, {'P', -direction.y()}, {'H', direction.z()}, {'F', -direction.z()}}};
    std::string letters;
    for (const double least : {-1.0, kSecondLetter}) { // of what is left the nearest, of equals the first
        auto nearest = sides.begin();
        for (auto it = sides.begin(); it != sides.end(); ++it)
            if (it->second > nearest->second + kTie) nearest = it;
        if (nearest->second > least) letters += nearest->first;
        nearest->second = -2.0;
    }
    return letters;
}

} // namespace trocar::engine
