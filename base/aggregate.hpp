// How many members a plain struct has, and all of them as a tuple: what goes through every member cannot fall behind the struct.
#pragma once

#include <cstddef>
#include <optional>
#include <tuple>
#include <type_traits>

namespace trocar {

namespace aggregate_detail {

template <class T>
inline constexpr bool is_optional = false;
template <class T>
inline constexpr bool is_optional<std::optional<T>> = true;

/// Stand for a value of any type of their kind; never evaluated. Apart, or std::optional could be made of one in two ways.
struct AnyClass {
    template <class T>
    requires(!std::is_arithmetic_v<T> && !std::is_enum_v<T> && !is_optional<T>) operator T() const;
};
struct AnyOptional {
    template <class T>
    requires is_optional<T>
    operator T() const;
};
struct AnyScalar {
    template <class T>
    requires(std::is_arithmetic_v<T> || std::is_enum_v<T>) operator T() const;
};

/// AnyClass comes first: a scalar for a nested struct would be taken for its first member.
template <class T, class... Found>
consteval std::size_t count_members() {
    if constexpr (requires { T{Found{}..., AnyClass{}}; })
        return count_members<T, Found..., AnyClass>();
    else if constexpr (requires { T{Found{}..., AnyOptional{}}; })
        return count_members<T, Found..., AnyOptional>();
    else if constexpr (requires { T{Found{}..., AnyScalar{}}; })
        return count_members<T, Found..., AnyScalar>();
    else
        return sizeof...(Found);
}

} // namespace aggregate_detail

/// Of an aggregate without base classes and C arrays.
template <class T>
requires std::is_aggregate_v<T>
inline constexpr std::size_t member_count = aggregate_detail::count_members<std::remove_const_t<T>>();

/// A tuple of references to all members, in the struct's order.
template <class T>
[[nodiscard]] constexpr auto tie_members(T& value) noexcept {
    constexpr std::size_t count = member_count<std::remove_const_t<T>>;
    static_assert(count >= 1 && count <= 32, "a struct with more members needs another line here");
#define TROCAR_TIE(number, ...)                                                                                                            \
    if constexpr (count == number) {                                                                                                       \
        auto& [__VA_ARGS__] = value;                                                                                                       \
        return std::tie(__VA_ARGS__);                                                                                                      \
    }
    TROCAR_TIE(1, a)
    TROCAR_TIE(2, a, b)
    TROCAR_TIE(3, a, b, c)
    TROCAR_TIE(4, a, b, c, d)
    TROCAR_TIE(5, a, b, c, d, e)
    TROCAR_TIE(6, a, b, c, d, e, f)
    TROCAR_TIE(7, a, b, c, d, e, f, g)
    TROCAR_TIE(8, a, b, c, d, e, f, g, h)
    TROCAR_TIE(9, a, b, c, d, e, f, g, h, i)
    TROCAR_TIE(10, a, b, c, d, e, f, g, h, i, j)
    TROCAR_TIE(11, a, b, c, d, e, f, g, h, i, j, k)
    TROCAR_TIE(12, a, b, c, d, e, f, g, h, i, j, k, l)
    TROCAR_TIE(13, a, b, c, d, e, f, g, h, i, j, k, l, m)
    TROCAR_TIE(14, a, b, c, d, e, f, g, h, i, j, k, l, m, n)
    TROCAR_TIE(15, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o)
    TROCAR_TIE(16, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p)
    TROCAR_TIE(17, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q)
    TROCAR_TIE(18, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r)
    TROCAR_TIE(19, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s)
    TROCAR_TIE(20, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t)
    TROCAR_TIE(21, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u)
    TROCAR_TIE(22, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v)
    TROCAR_TIE(23, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w)
    TROCAR_TIE(24, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x)
    TROCAR_TIE(25, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y)
    TROCAR_TIE(26, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z)
    TROCAR_TIE(27, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa)
    TROCAR_TIE(28, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, bb)
    TROCAR_TIE(29, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, bb, cc)
    TROCAR_TIE(30, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, bb, cc, dd)
    TROCAR_TIE(31, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, bb, cc, dd, ee)
    TROCAR_TIE(32, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, bb, cc, dd, ee, ff)
#undef TROCAR_TIE
}

} // namespace trocar
