#include "engine/step/instrument/cull_worker.hpp"

#include "engine/time/clock.hpp"

#include <cassert>
#include <utility>

namespace trocar::engine {

CullWorker::CullWorker(std::unique_ptr<collision::CullBackend> backend)
    : backend_(std::move(backend)), name_(backend_->name()), thread_([this] { work(); }) {}

CullWorker::~CullWorker() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

bool CullWorker::busy() {
    const std::lock_guard lock(mutex_);
    return busy_;
}

void CullWorker::reserve(std::size_t prisms, std::size_t pairs, int resolution) {
    const std::lock_guard lock(mutex_); // the thread waits, and touches neither
    assert(!busy_);
    snapshot_.reserve(prisms, pairs);
    backend_->reserve(prisms, prisms, resolution); // of two sets each prism asks for one
}

void CullWorker::start(collision::CullSnapshot& snapshot, const collision::CullPlan& plan) {
    {
        const std::lock_guard lock(mutex_);
        assert(!busy_);
        std::swap(snapshot_, snapshot);
        plan_ = plan;
        busy_ = true;
    }
    changed_.notify_all();
}

void CullWorker::wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !busy_; });
}

Result<void> CullWorker::take(collision::CullSnapshot& snapshot, double& seconds) {
    const std::lock_guard lock(mutex_);
    assert(!busy_);
    std::swap(snapshot_, snapshot);
    seconds = seconds_;
    return result_;
}

void CullWorker::work() {
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [this] { return busy_ || stopping_; });
        if (!busy_) return;
        lock.unlock();
        const StopWatch watch;
        Result<void> result = snapshot_.look(plan_, *backend_);
        lock.lock();
        seconds_ = 1e-3 * watch.elapsed_ms();
        result_ = std::move(result);
        busy_ = false;
        changed_.notify_all();
    }
}

} // namespace trocar::engine
