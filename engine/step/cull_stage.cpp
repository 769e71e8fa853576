#include "engine/step/cull_stage.hpp"

#include <algorithm>
#include <utility>

namespace seldinger::engine {

CullStage::CullStage(Culling choice) noexcept : choice_(choice), cost_(kTwinRates) {}

void CullStage::set_device(std::unique_ptr<collision::CullBackend> device) {
    worker_ = std::make_unique<CullWorker>(std::move(device));
    cost_ = CullCostModel(kDeviceRates);
    collision::CullSnapshot first;
    first.prisms.assign(2, {Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY()});
    first.corners = {{0, 1, 2}, {3, 4, 5}};
    first.set_of = {0, 1};
    first.pairs = {{0, 1}};
    worker_->start(first, {.resolution = kCullResolution});
    worker_->wait();
    double seconds = 0.0;
    if (const auto looked = worker_->take(first, seconds); !looked.ok()) give_up_device(looked.error());
}

void CullStage::give_up_device(const Error& error) {
    notes_.push_back("culling by the CPU twin from here on: " + error.message);
    worker_.reset();
    cost_ = CullCostModel(kTwinRates);
    late_items_ = 0;
}

/// Still at a look whose answer was dropped? What that cost is learnt as soon as it has ended.
bool CullStage::device_is_busy() {
    if (!worker_ || late_items_ == 0) return false;
    if (worker_->busy()) {
        if (mode_ == BudgetMode::Wall) return true;
        worker_->wait();
    }
    double seconds = 0.0;
    const auto looked = worker_->take(snapshot_, seconds);
    const std::size_t items = std::exchange(late_items_, 0);
    if (!looked.ok())
        give_up_device(looked.error());
    else
        cost_.note_late_look(items, seconds);
    return false;
}

bool CullStage::wanted(std::size_t items, StepBudget* budget) {
    if (choice_ == Culling::Never) return false;
    mode_ = budget != nullptr ? budget->limits().mode : BudgetMode::Exact;
    if (budget == nullptr) return forced();
    const bool chosen = budget->choose_cull(cost_.look_s(items), forced() || cost_.pays(items));
    if (!chosen) {
        cost_.pass_over();
        tally_.left_out += forced(); // no time for what the scene asks for
    }
    return chosen;
}

void CullStage::begin(const collision::SurfacePair& pair, const collision::CandidateLists& candidates,
                      const collision::PairOptions& options, WorkBudget& budget) {
    answered_ = waiting_ = false;
    items_ = candidates.size();
    apart_ = 0;
    look_s_ = 0.0;
    since_begin_ = StopWatch();
    if (items_ == 0) return;
    if (device_is_busy() || (mode_ == BudgetMode::Work && !budget.spend(kTestsPerCulledItem * items_))) {
        ++tally_.left_out;
        return;
    }
    culler_.gather(pair, candidates, options, snapshot_);
    tally_.items += items_;
    if (!worker_) return look_by_twin();
    worker_->start(snapshot_, {.resolution = kCullResolution});
    waiting_ = true;
    if (mode_ == BudgetMode::Wall) return; // the tests begin meanwhile
    worker_->wait();
    take_answer();
}

void CullStage::look_by_twin() {
    const StopWatch watch;
    const auto looked = snapshot_.look({.resolution = kCullResolution}, twin_);
    answered_ = looked.ok(); // the twin never fails
    look_s_ += 1e-3 * watch.elapsed_ms();
    tally_.by = std::max(tally_.by, CulledBy::CpuTwin);
    note_answer(look_s_);
}

void CullStage::take_answer() {
    waiting_ = false;
    double seconds = 0.0;
    const auto looked = worker_->take(snapshot_, seconds);
    if (looked.ok()) {
        answered_ = true;
        tally_.by = CulledBy::Device;
        note_answer(seconds);
        return;
    }
    give_up_device(looked.error());
    if (mode_ != BudgetMode::Wall) look_by_twin(); // as if it had been asked: the same answer on every machine
}

void CullStage::note_answer(double seconds) {
    for (std::size_t k = 0; k < items_; ++k) apart_ += is_apart(k);
    tally_.apart += apart_;
    if (mode_ == BudgetMode::Wall) cost_.note_look(items_, items_ - apart_, seconds);
}

void CullStage::poll() {
    if (waiting_ && !worker_->busy()) take_answer();
}

bool CullStage::is_apart(std::size_t candidate) const noexcept {
    if (!answered_) return false;
    const Index pair = culler_.pair_of(candidate);
    return pair != kNoIndex && snapshot_.apart[pair] != 0;
}

void CullStage::end() {
    tally_.late += waiting_;
    if (waiting_) late_items_ = items_;
    waiting_ = false;
    if (mode_ == BudgetMode::Wall) cost_.note_tests(items_ - apart_, 1e-3 * since_begin_.elapsed_ms() - look_s_);
}

void CullStage::tell(StepReport& report) {
    report.culled_by = std::max(report.culled_by, static_cast<unsigned>(tally_.by));
    report.cull_items += tally_.items;
    report.cull_apart += tally_.apart;
    report.cull_late += tally_.late;
    report.cull_left_out += tally_.left_out;
    tally_ = {};
}

} // namespace seldinger::engine
