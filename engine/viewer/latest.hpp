// The latest of what one thread makes, for another that polls now and then: three buffers, so that neither ever waits and
// none reads a half-written one.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace trocar::engine::viewer {

template <class T>
class Latest {
public:
    /// The producer's buffer: fill it, then publish.
    [[nodiscard]] T& back() noexcept { return places_[back_]; }
    void publish() noexcept { back_ = middle_.exchange(static_cast<std::uint8_t>(back_ | kFresh), std::memory_order_acq_rel) & kIndex; }
    /// For the producer: has the last one been taken? False: another would only replace it.
    [[nodiscard]] bool taken() const noexcept { return (middle_.load(std::memory_order_acquire) & kFresh) == 0; }

    /// The consumer's buffer: the last one taken.
    [[nodiscard]] const T& front() const noexcept { return places_[front_]; }
    /// Takes the latest one. False: nothing new.
    bool take() noexcept {
        if (taken()) return false;
        front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
        return true;
    }

    /// Before the threads start: every buffer in turn, to size them.
    [[nodiscard]] std::array<T, 3>& places() noexcept { return places_; }

private:
    static constexpr std::uint8_t kFresh = 4, kIndex = 3;
    std::array<T, 3> places_;
    std::uint8_t back_ = 0, front_ = 2;
    std::atomic<std::uint8_t> middle_{1};
};

} // namespace trocar::engine::viewer
