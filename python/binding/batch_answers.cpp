#include "python/binding/batch_answers.hpp"

#include <algorithm>
#include <cstring>

namespace trocar::python {

namespace {

static_assert(sizeof(engine::OutcomeRow) == 8 * (3 + engine::kRewardTerms + 13));

/// Members of a row in their order; `terms` has one number for each term of the reward.
constexpr const char* kMembers[] = {"remaining", "distance", "force", "terms", "exits", "unresolved", "assumed", "overruns", "exact_steps",
                                    "contacts", "action", "hash", "task", "target", "start", "failed", "began"};
/// Of these, what infos hold under its own name.
constexpr const char* kTold[] = {"remaining", "distance", "force", "exits", "unresolved", "assumed", "overruns", "exact_steps", "contacts", "hash",
                                 "task", "target", "start"};

bool is_real(const char* member) { return std::strcmp(member, "remaining") == 0 || std::strcmp(member, "distance") == 0 || std::strcmp(member, "force") == 0; }

py::array read_only(const py::array& array) {
    py::array view = array[py::ellipsis()];
    view.attr("setflags")(py::arg("write") = false);
    return view;
}

template <class T>
py::array_t<T> zeros(std::vector<py::ssize_t> shape) {
    py::array_t<T> array(std::move(shape));
    std::fill_n(array.mutable_data(), array.size(), T{});
    return array;
}

} // namespace

AnswerSet::AsMade AnswerSet::read(const PyObject* array) {
    AsMade as{array, Py_REFCNT(array), *py::detail::array_proxy(array), {}, {}};
    std::copy_n(as.header.dimensions, std::min(as.header.nd, 4), as.shape.begin());
    std::copy_n(as.header.strides, std::min(as.header.nd, 4), as.strides.begin());
    return as;
}

AnswerSet::AnswerSet(AnswerArrays made, py::dict views) : arrays(std::move(made)), infos(std::move(views)) {
    const auto add = [&](const py::handle& array) {
        const bool known = std::any_of(made_.begin(), made_.end(), [&](const AsMade& as) { return as.array == array.ptr(); });
        if (!known) made_.push_back(read(array.ptr()));
    };
    for (const py::array* array : std::initializer_list<const py::array*>{&arrays.observation, &arrays.reward, &arrays.terminated, &arrays.truncated, &arrays.outcome, &arrays.pixels, &arrays.tips})
        add(*array);
    for (const auto& [key, value] : infos)
        if (py::cast<std::string>(key)[0] != '_') add(value); // masks are shared by all answers
}

bool AnswerSet::is_free() const {
    // Not one after the other's answer: the processor then fetches the arrays side by side.
    bool free = true;
    for (const AsMade& as : made_) {
        const auto* header = py::detail::array_proxy(as.array);
        free &= Py_REFCNT(as.array) == as.references && header->data == as.header.data && header->nd == as.header.nd && header->base == as.header.base &&
                header->descr == as.header.descr && header->flags == as.header.flags;
    }
    return free && std::all_of(made_.begin(), made_.end(), [](const AsMade& as) {
        const AsMade now = read(as.array);
        return now.shape == as.shape && now.strides == as.strides;
    });
}

py::dtype BatchAnswers::outcome_dtype() {
    py::list fields;
    for (const char* member : kMembers) {
        if (std::strcmp(member, "terms") == 0) fields.append(py::make_tuple(member, "<f8", py::make_tuple(engine::kRewardTerms)));
        else fields.append(py::make_tuple(member, is_real(member) ? "<f8" : "<u8"));
    }
    return py::dtype::from_args(fields);
}

BatchAnswers::BatchAnswers(py::ssize_t count, py::ssize_t observation_size, py::ssize_t devices, std::array<py::ssize_t, 3> picture, bool copy)
    : count_(count), observation_size_(observation_size), devices_(devices), picture_(picture), copy_(copy), row_(outcome_dtype()),
      final_observation_(zeros<float>({count, observation_size})), final_pixels_(zeros<std::uint8_t>({count, picture[0], picture[1], picture[2]})) {
    const py::dict offsets = row_.attr("fields");
    const auto row = static_cast<py::ssize_t>(sizeof(engine::OutcomeRow));
    const auto add = [&](const char* key, const char* member) {
        Field field{py::str(key), is_real(member) ? py::dtype::of<double>() : py::dtype::of<std::uint64_t>(), {count_}, {row}, 0};
        field.offset = offsets[member].cast<py::tuple>()[1].cast<py::ssize_t>();
        fields_.push_back(std::move(field));
    };
    for (const char* name : kTold) add(name, name);
    add("reward_terms", "terms");
    Field& terms = fields_.back();
    terms.type = py::dtype::of<double>(), terms.shape.push_back(engine::kRewardTerms), terms.strides.push_back(sizeof(double));

    py::array_t<bool> all(count);
    std::fill_n(all.mutable_data(), count, true);
    all.attr("setflags")(py::arg("write") = false);
    for (const Field& field : fields_) masks_[py::str("_{}").format(field.key)] = all;
    masks_["_success"] = all;
    last_ = make_set();
    const AnswerArrays& first = last_->arrays;
    for (py::array array : {py::array(first.observation), py::array(first.reward), py::array(first.terminated), py::array(first.truncated), first.outcome, py::array(first.pixels), py::array(first.tips)})
        std::memset(array.mutable_data(), 0, static_cast<std::size_t>(array.nbytes()));
    if (copy_) return;
    views_ = {read_only(first.observation), read_only(first.reward), read_only(first.terminated), read_only(first.truncated), read_only(first.outcome), read_only(first.pixels),
              read_only(first.tips)};
    view_infos_ = make_infos(views_.outcome, views_.terminated);
}

AnswerArrays BatchAnswers::make_arrays() const {
    return {py::array_t<float>({count_, observation_size_}), py::array_t<double>(count_), py::array_t<bool>(count_), py::array_t<bool>(count_),
            py::array(row_, std::vector<py::ssize_t>{count_}), py::array_t<std::uint8_t>({count_, picture_[0], picture_[1], picture_[2]}),
            py::array_t<double>({picture_[2] > 0 ? count_ : py::ssize_t{0}, devices_, py::ssize_t{2}})};
}

py::dict BatchAnswers::make_infos(const py::array& outcome, const py::array& success) const {
    auto infos = py::reinterpret_steal<py::dict>(PyDict_Copy(masks_.ptr()));
    if (!infos) throw py::error_already_set();
    const char* const first = static_cast<const char*>(outcome.data());
    const auto set = [&](const py::str& key, const py::array& value) {
        if (PyDict_SetItem(infos.ptr(), key.ptr(), value.ptr()) != 0) throw py::error_already_set();
    };
    for (const Field& field : fields_) set(field.key, py::array(field.type, field.shape, field.strides, first + field.offset, outcome));
    set(success_key_, success);
    return infos;
}

BatchAnswers::SetPtr BatchAnswers::make_set() const {
    AnswerArrays arrays = make_arrays();
    py::dict infos = make_infos(arrays.outcome, arrays.terminated);
    return std::make_shared<AnswerSet>(std::move(arrays), std::move(infos));
}

BatchAnswers::SetPtr BatchAnswers::find_free() {
    for (const SetPtr& set : sets_)
        if (set != last_ && set->is_free()) return set; // the last one can be asked for again: outcome(), observation()
    SetPtr made = make_set();
    if (sets_.size() < kKept) sets_.push_back(made);
    else sets_[oldest_ % kKept] = made, ++oldest_;
    return made;
}

BatchAnswers::Next BatchAnswers::next() {
    const SetPtr set = copy_ ? find_free() : last_;
    const AnswerArrays& told = copy_ ? set->arrays : views_;
    auto infos = py::reinterpret_steal<py::dict>(PyDict_Copy((copy_ ? set->infos : view_infos_).ptr()));
    if (!infos) throw py::error_already_set();
    return {set, py::make_tuple(told.observation, told.reward, told.terminated, told.truncated, infos)};
}

engine::BatchArrays BatchAnswers::pointers(Next& next) {
    AnswerArrays& to = next.set->arrays;
    return {to.observation.mutable_data(), final_observation_.mutable_data(), to.pixels.mutable_data(), final_pixels_.mutable_data(), to.tips.mutable_data(), to.reward.mutable_data(), to.terminated.mutable_data(),
            to.truncated.mutable_data(), static_cast<engine::OutcomeRow*>(to.outcome.mutable_data())};
}

py::array BatchAnswers::outcome() const { return read_only(last_->arrays.outcome); }
py::array BatchAnswers::observation() const { return copy_ ? last_->arrays.observation : views_.observation; }
py::array BatchAnswers::pixels() const { return copy_ ? py::array(last_->arrays.pixels) : read_only(last_->arrays.pixels); }
py::array BatchAnswers::tips() const { return copy_ ? py::array(last_->arrays.tips) : read_only(last_->arrays.tips); }
py::array BatchAnswers::final_pixels() const { return read_only(final_pixels_); }
py::array BatchAnswers::final_observation() const { return read_only(final_observation_); }

} // namespace trocar::python
