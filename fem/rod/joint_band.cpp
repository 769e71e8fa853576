#include "fem/rod/joint_band.hpp"

#include <algorithm>
#include <tuple>

namespace trocar::fem {

void JointBand::reserve(std::size_t rows, std::size_t entries) {
    for (auto* list : {&row_, &end_, &from_}) list->reserve(rows);
    data_.reserve(entries);
    for (auto* list : {&before_, &moved_}) list->reserve(rows);
}

void JointBand::order(std::span<Node> nodes) {
    std::sort(nodes.begin(), nodes.end(),
              [](const Node& a, const Node& b) { return std::tuple(a.chain, a.arc, a.coordinate) < std::tuple(b.chain, b.arc, b.coordinate); });
    std::size_t rows = 0;
    for (const Node& node : nodes) rows += node.count;
    row_.resize(rows), end_.resize(rows);
    std::size_t row = 0;
    for (const Node& node : nodes)
        for (std::size_t k = 0; k < node.count; ++k) row_[node.coordinate + k] = row++;
    for (std::size_t r = 0; r < rows; ++r) end_[r] = r;
}

void JointBand::couple(std::size_t a, std::size_t b) noexcept {
    const auto [low, high] = std::minmax(row_[a], row_[b]);
    end_[low] = std::max(end_[low], high);
}

void JointBand::begin() {
    from_.resize(end_.size());
    std::size_t entries = 0, end = 0, longest = 0;
    for (std::size_t c = 0; c < end_.size(); ++c) {
        end = end_[c] = std::max(end, end_[c]);
        from_[c] = entries;
        entries += end - c + 1;
        longest = std::max(longest, end - c + 1);
    }
    data_.assign(entries, 0.0);
    before_.resize(std::max(before_.size(), longest));
    moved_.resize(end_.size());
}

void JointBand::add(std::size_t a, std::size_t b, double value) noexcept {
    const auto [low, high] = std::minmax(row_[a], row_[b]);
    data_[from_[low] + high - low] += value;
}

void JointBand::factorise() noexcept {
    double* const before = before_.data(); // L D
    for (std::size_t c = 0; c < end_.size(); ++c) {
        double* const own = data_.data() + from_[c];
        const std::size_t reach = end_[c] - c;
        for (std::size_t m = 1; m <= reach; ++m) before[m] = own[m];
        for (std::size_t m = 1; m <= reach; ++m) own[m] = before[m] / own[0];
        for (std::size_t i = 1; i <= reach; ++i) {
            const double share = own[i];
            if (share == 0.0) continue; // of two rods that are not coupled here
            double* const other = data_.data() + from_[c + i];
            for (std::size_t m = i; m <= reach; ++m) other[m - i] -= before[m] * share;
        }
    }
}

void JointBand::solve(std::span<double> x) noexcept {
    double* const y = moved_.data();
    const std::size_t rows = end_.size();
    for (std::size_t k = 0; k < rows; ++k) y[row_[k]] = x[k];
    for (std::size_t c = 0; c < rows; ++c) {
        const double* const own = data_.data() + from_[c];
        const double at = y[c];
        for (std::size_t m = end_[c] - c; m > 0; --m) y[c + m] -= own[m] * at;
    }
    for (std::size_t c = 0; c < rows; ++c) y[c] /= data_[from_[c]];
    for (std::size_t c = rows; c-- > 0;) {
        const double* const own = data_.data() + from_[c];
        double sum = y[c];
        for (std::size_t m = end_[c] - c; m > 0; --m) sum -= own[m] * y[c + m];
        y[c] = sum;
    }
    for (std::size_t k = 0; k < rows; ++k) x[k] = y[row_[k]];
}

} // namespace trocar::fem
