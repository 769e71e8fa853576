#include "engine/step/instrument/cull_stage.hpp"

#include <algorithm>
#include <utility>

namespace trocar::engine {

namespace {

/// Two sheets through each other, in squares of two triangles: each triangle of the one crosses that of the other at the same place, so no
/// view tells them apart.
collision::CullSnapshot make_probe(std::size_t pairs) {
    collision::CullSnapshot probe;
    constexpr std::size_t kColumns = 64;
    for (std::size_t k = 0; k < pairs; ++k)
        for (const Index sheet : {0u, 1u}) {
            const std::size_t square = k / 2;
            const Vec3 at(static_cast<double>(square % kColumns), static_cast<double>(square / kColumns), 0.0);
            const double tilt = sheet == 0 ? 0.1 : -0.1;
            const Vec3 a = at + (k % 2 == 0 ? Vec3(0.0, 0.0, tilt) : Vec3(1.0, 1.0, tilt));
            const Vec3 b = at + Vec3(1.0, 0.0, -tilt), c = at + Vec3(0.0, 1.0, -tilt);
            probe.prisms.push_back({a, b, c, a, b, c});
            const auto name = static_cast<Index>(3 * probe.corners.size());
            probe.corners.push_back({name, name + 1, name + 2});
            probe.set_of.push_back(sheet);
        }
    for (std::size_t k = 0; k < pairs; ++k) probe.pairs.push_back({static_cast<Index>(2 * k), static_cast<Index>(2 * k + 1)});
    probe.reach = 1e-3;
    return probe;
}

} // namespace

CullStage::CullStage(Culling choice) noexcept : choice_(choice), cost_(kCpuReferenceRates) {}

void CullStage::reserve(std::size_t triangles_a, std::size_t triangles_b) {
    if (choice_ == Culling::Never) return;
    triangles_a_ = std::max(triangles_a_, triangles_a);
    triangles_b_ = std::max(triangles_b_, triangles_b);
    culler_.reserve(kReservedCullCandidates, triangles_a_, triangles_b_);
    snapshot_.reserve(triangles_a_ + triangles_b_, kReservedCullCandidates);
    reference_.reserve(triangles_a_ + triangles_b_, triangles_a_ + triangles_b_, kCullResolution);
}

void CullStage::set_device(std::unique_ptr<collision::CullBackend> device) {
    worker_ = std::make_unique<CullWorker>(std::move(device));
    cost_ = CullCostModel(kDeviceRates);
    probes_.clear();
    probe_device();
    if (worker_) worker_->reserve(triangles_a_ + triangles_b_, kReservedCullCandidates, kCullResolution);
}

/// The first draw of each size is for the driver, and for memory to grow; the second one is measured.
void CullStage::probe_device() {
    for (const std::size_t pairs : kProbePairs)
        for (const bool measured : {false, true}) {
            collision::CullSnapshot probe = make_probe(pairs);
            worker_->start(probe, {.resolution = kCullResolution});
            worker_->wait();
            double seconds = 0.0;
            if (const auto looked = worker_->take(probe, seconds); !looked.ok()) return give_up_device(looked.error());
            if (measured) probes_.push_back({pairs, seconds});
        }
}

/// Where a clock may decide.
void CullStage::learn_probes() {
    for (const Probe& probe : probes_) cost_.note_late_culling(probe.items, probe.seconds);
    probes_.clear();
}

void CullStage::give_up_device(const Error& error) {
    notes_.push_back("culling by the CPU reference from here on: " + error.message);
    worker_.reset();
    probes_.clear();
    cost_ = CullCostModel(kCpuReferenceRates);
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
        cost_.note_late_culling(items, seconds);
    return false;
}

bool CullStage::wanted(std::size_t items, StepBudget* budget) {
    if (choice_ == Culling::Never) return false;
    mode_ = budget != nullptr ? budget->limits().mode : BudgetMode::Exact;
    if (budget == nullptr) return forced();
    if (mode_ == BudgetMode::Wall) learn_probes();
    const bool chosen = budget->choose_cull(cost_.culling_s(items), forced() || cost_.pays(items));
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
    culling_s_ = 0.0;
    since_begin_ = StopWatch();
    if (items_ == 0) return;
    if (device_is_busy() || (mode_ == BudgetMode::Work && !budget.spend(kTestsPerCulledItem * items_))) {
        ++tally_.left_out;
        return;
    }
    culler_.gather(pair, candidates, options, snapshot_);
    tally_.items += items_;
    if (!worker_) return cull_on_cpu();
    worker_->start(snapshot_, {.resolution = kCullResolution});
    waiting_ = true;
    if (mode_ == BudgetMode::Wall) return; // the tests begin meanwhile
    worker_->wait();
    take_answer();
}

void CullStage::cull_on_cpu() {
    const StopWatch watch;
    const auto looked = snapshot_.look({.resolution = kCullResolution}, reference_);
    answered_ = looked.ok(); // the CPU reference never fails
    culling_s_ += 1e-3 * watch.elapsed_ms();
    tally_.by = std::max(tally_.by, CulledBy::CpuReference);
    note_answer(culling_s_);
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
    if (mode_ != BudgetMode::Wall) cull_on_cpu(); // as if it had been asked: the same answer on every machine
}

void CullStage::note_answer(double seconds) {
    for (std::size_t k = 0; k < items_; ++k) apart_ += is_apart(k);
    tally_.apart += apart_;
    if (mode_ == BudgetMode::Wall) cost_.note_culling(items_, items_ - apart_, seconds);
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
    if (mode_ == BudgetMode::Wall) cost_.note_tests(items_ - apart_, 1e-3 * since_begin_.elapsed_ms() - culling_s_);
}

void CullStage::tell(StepReport& report) {
    report.culled_by = std::max(report.culled_by, static_cast<unsigned>(tally_.by));
    report.cull_items += tally_.items;
    report.cull_apart += tally_.apart;
    report.cull_late += tally_.late;
    report.cull_left_out += tally_.left_out;
    tally_ = {};
}

} // namespace trocar::engine
