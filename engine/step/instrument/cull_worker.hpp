// A device for image-space culling, on a thread of its own: a draw that was sent cannot be recalled, so the step does not wait for it
// unless it must. It works on a snapshot; an answer that comes too late is dropped.
#pragma once

#include "collision/search/candidate_culler.hpp"

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace trocar::engine {

class CullWorker {
public:
    explicit CullWorker(std::unique_ptr<collision::CullBackend> backend);
    /// Waits for the draw under way.
    ~CullWorker();
    CullWorker(const CullWorker&) = delete;
    CullWorker& operator=(const CullWorker&) = delete;

    [[nodiscard]] const std::string& name() const noexcept { return name_; }
    /// Still drawing, perhaps what was dropped.
    [[nodiscard]] bool busy();
    /// As CullSnapshot::reserve and CullBackend::reserve. Must not be busy.
    void reserve(std::size_t prisms, std::size_t pairs, int resolution);
    /// Takes the snapshot, and leaves the memory of an earlier one in its place. Must not be busy.
    void start(collision::CullSnapshot& snapshot, const collision::CullPlan& plan);
    void wait();
    /// The answer of the last draw, which must be finished. seconds   s, that it took
    /// fails   as the device did
    [[nodiscard]] Result<void> take(collision::CullSnapshot& snapshot, double& seconds);

private:
    void work();

    std::unique_ptr<collision::CullBackend> backend_; // the thread's while busy
    const std::string name_;
    std::mutex mutex_;
    std::condition_variable changed_;
    bool busy_ = false, stopping_ = false;
    collision::CullSnapshot snapshot_; // the thread's while busy
    collision::CullPlan plan_;
    Result<void> result_;
    double seconds_ = 0.0;
    std::thread thread_; // last: it uses all of the above
};

} // namespace trocar::engine
