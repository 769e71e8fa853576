// Vectors, matrices and index types shared by every module. SI units, world frame, right-handed.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cstdint>
#include <limits>

namespace trocar {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

using Index = std::uint32_t;
using Triangle = std::array<Index, 3>;
using Tet = std::array<Index, 4>;

/// No vertex, node, triangle or sphere: a link to no host, a tree without a parent.
inline constexpr Index kNoIndex = std::numeric_limits<Index>::max();

[[nodiscard]] inline bool is_finite(const Vec3& v) noexcept { return v.allFinite(); }

} // namespace trocar
