// Threads that wait for work in batches. Which thread does what is not fixed, so work may not depend on it.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace trocar::engine {

class ThreadPool {
public:
    /// threads   at least 1; the caller of for_each is one of them
    explicit ThreadPool(unsigned threads);
    /// In a process that was forked from the pool's the threads do not exist, and nothing is waited for.
    ~ThreadPool();
    ThreadPool(const ThreadPool&) = delete;
    ThreadPool& operator=(const ThreadPool&) = delete;

    [[nodiscard]] unsigned size() const noexcept;
    /// False: this process was forked from the one that made the pool; for_each would wait for ever.
    [[nodiscard]] bool is_of_this_process() const noexcept;

    /// Calls work(item, thread) for every item below count, thread below size(); returns when all are done. One caller at a time. After
    /// an exception no new item is begun, and the first is thrown here.
    /// between   called on the caller's thread after each of its own items; may throw
    /// cost      no allocation
    void for_each(std::size_t count, const std::function<void(std::size_t, unsigned)>& work, const std::function<void()>& between = {});

private:
    struct Shared;
    std::unique_ptr<Shared> shared_;
};

} // namespace trocar::engine
