#include "python/binding/long_call.hpp"

#include <pybind11/pybind11.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace trocar::python {

namespace {

/// Between two looks for a signal.
constexpr std::chrono::milliseconds kLook{20};

struct Call {
    std::mutex mutex;
    std::condition_variable done_changed;
    bool done = false;
    std::atomic<bool> stop{false};
    std::exception_ptr failure;
};

struct LeftWork {
    std::thread thread;
    std::shared_ptr<Call> call;
};

std::mutex left_mutex;
std::vector<LeftWork> left_work; // after an interruption, until it has ended

bool is_done(Call& call) {
    const std::lock_guard lock(call.mutex);
    return call.done;
}

void leave(std::thread thread, std::shared_ptr<Call> call) {
    const std::lock_guard lock(left_mutex);
    std::erase_if(left_work, [](LeftWork& left) { // those that have ended since
        if (!is_done(*left.call)) return false;
        left.thread.join();
        return true;
    });
    left_work.push_back({std::move(thread), std::move(call)});
}

} // namespace

void run_long(std::function<void(const StopCheck&)> work) {
    const auto call = std::make_shared<Call>();
    std::thread thread([call, work = std::move(work)]() mutable {
        try {
            work([&call] {
                if (call->stop.load(std::memory_order_relaxed)) throw Interrupted{};
            });
        } catch (const Interrupted&) { // nobody waits for it
        } catch (...) {
            call->failure = std::current_exception();
        }
        work = nullptr; // what it owns goes before it counts as done
        const std::lock_guard lock(call->mutex);
        call->done = true;
        call->done_changed.notify_all();
    });
    bool interrupted = false;
    for (bool done = false; !done && !interrupted;) {
        {
            const pybind11::gil_scoped_release released;
            std::unique_lock lock(call->mutex);
            done = call->done_changed.wait_for(lock, kLook, [&] { return call->done; });
        }
        if (!done) interrupted = PyErr_CheckSignals() != 0;
    }
    if (interrupted) {
        call->stop.store(true);
        leave(std::move(thread), call);
        throw pybind11::error_already_set();
    }
    thread.join();
    if (call->failure) std::rethrow_exception(call->failure);
}

void join_left_work() {
    std::vector<LeftWork> left;
    {
        const std::lock_guard lock(left_mutex);
        left.swap(left_work);
    }
    const pybind11::gil_scoped_release released;
    for (LeftWork& each : left) each.thread.join();
}

} // namespace trocar::python
