#include "engine/episodes/thread_pool.hpp"

#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace trocar::engine {

/// What the threads see.
struct ThreadPool::Shared {
    int process = getpid();
    std::mutex mutex;
    std::condition_variable begun, ended;
    std::uint64_t batch = 0; // counts batches
    bool quits = false;
    unsigned running = 0; // threads that have not ended the batch
    const std::function<void(std::size_t, unsigned)>* work = nullptr;
    std::size_t count = 0;
    std::atomic<std::size_t> next{0};
    std::exception_ptr failure;
    std::vector<std::thread> threads;

    void take_items(unsigned thread, const std::function<void()>* between) {
        try {
            for (std::size_t item; (item = next.fetch_add(1)) < count;) {
                (*work)(item, thread);
                if (between != nullptr && *between) (*between)();
            }
        } catch (...) {
            next.store(count);
            const std::lock_guard lock(mutex);
            if (!failure) failure = std::current_exception();
        }
    }

    void run(unsigned thread) {
        for (std::uint64_t seen = 0;;) {
            {
                std::unique_lock lock(mutex);
                begun.wait(lock, [&] { return quits || batch != seen; });
                if (quits) return;
                seen = batch;
            }
            take_items(thread, nullptr);
            const std::lock_guard lock(mutex);
            if (--running == 0) ended.notify_one();
        }
    }
};

ThreadPool::ThreadPool(unsigned threads) : shared_(std::make_unique<Shared>()) {
    for (unsigned k = 1; k < threads; ++k) shared_->threads.emplace_back([shared = shared_.get(), k] { shared->run(k); });
}

ThreadPool::~ThreadPool() {
    if (!is_of_this_process()) { // its conditions have waiters that do not exist: they can be neither woken nor destroyed
        (void)shared_.release();
        return;
    }
    {
        const std::lock_guard lock(shared_->mutex);
        shared_->quits = true;
    }
    shared_->begun.notify_all();
    for (std::thread& thread : shared_->threads) thread.join();
}

unsigned ThreadPool::size() const noexcept { return static_cast<unsigned>(shared_->threads.size()) + 1; }

bool ThreadPool::is_of_this_process() const noexcept { return getpid() == shared_->process; }

void ThreadPool::for_each(std::size_t count, const std::function<void(std::size_t, unsigned)>& work, const std::function<void()>& between) {
    Shared& s = *shared_;
    {
        const std::lock_guard lock(s.mutex);
        s.work = &work, s.count = count;
        s.next.store(0);
        s.failure = nullptr;
        s.running = size();
        ++s.batch;
    }
    if (!s.threads.empty()) s.begun.notify_all();
    s.take_items(0, &between);
    std::unique_lock lock(s.mutex);
    --s.running;
    s.ended.wait(lock, [&s] { return s.running == 0; });
    if (s.failure) std::rethrow_exception(std::exchange(s.failure, nullptr));
}

} // namespace trocar::engine
