// The arrays that a batch of environments writes into, and what its steps answer with. All of an answer is there before the engine's work, which
// writes into it: afterwards the caches hold the engine's memory, and whatever Python or numpy then do is fetched anew. For the same reason the
// arrays of an answer that nobody holds any more are used again.
#pragma once

#include "engine/episodes/environment_batch.hpp"

#include <pybind11/numpy.h>

#include <array>
#include <memory>
#include <vector>

namespace trocar::python {

namespace py = pybind11;

/// One set of arrays: [count][...] each.
struct AnswerArrays {
    py::array_t<float> observation;
    py::array_t<double> reward;
    py::array_t<bool> terminated, truncated;
    py::array outcome; // of BatchAnswers::outcome_dtype
    py::array_t<std::uint8_t> pixels; // [rows][columns][channels] each; empty: no pictures are observed
    py::array_t<double> tips;         // [devices][2] pixels, likewise
};

/// Arrays with the infos that are views of them; whether somebody else holds any of these arrays.
class AnswerSet {
public:
    AnswerSet(AnswerArrays made, py::dict infos);

    /// No reference to an array, and no view of one, is outside of this set, and every array is as it was made (a shape, for one, can be assigned).
    [[nodiscard]] bool is_free() const;

    AnswerArrays arrays;
    py::dict infos; // never handed out itself

private:
    struct AsMade {
        const PyObject* array;
        Py_ssize_t references;
        py::detail::PyArray_Proxy header; // where numpy has its shape and strides
        std::array<Py_ssize_t, 4> shape, strides;
    };
    [[nodiscard]] static AsMade read(const PyObject* array);

    std::vector<AsMade> made_;
};

class BatchAnswers {
public:
    using SetPtr = std::shared_ptr<AnswerSet>;

    /// An answer whose arrays are yet to be written.
    struct Next {
        SetPtr set;
        py::tuple told; // observations, rewards, terminated, truncated, infos
    };

    /// copy      answers are arrays of their own; otherwise read-only views of one set, which every step overwrites
    /// picture   rows, columns, channels; no channels: no pictures are observed
    BatchAnswers(py::ssize_t count, py::ssize_t observation_size, py::ssize_t devices, std::array<py::ssize_t, 3> picture, bool copy);

    [[nodiscard]] Next next();
    /// Where the engine writes it.
    [[nodiscard]] engine::BatchArrays pointers(Next& next);
    /// It has been written: the last answer from here on.
    void take(const Next& next) { last_ = next.set; }

    /// Of the last answer, read-only; the second of the last episodes that ended.
    [[nodiscard]] py::array outcome() const;
    [[nodiscard]] py::array final_observation() const;
    /// The last answer's own arrays, or read-only views as `copy` says; the fourth read-only.
    [[nodiscard]] py::array observation() const;
    [[nodiscard]] py::array pixels() const;
    [[nodiscard]] py::array tips() const;
    [[nodiscard]] py::array final_pixels() const;
    [[nodiscard]] static py::dtype outcome_dtype();

private:
    struct Field {
        py::str key;
        py::dtype type;
        std::vector<py::ssize_t> shape, strides;
        py::ssize_t offset = 0;
    };

    static constexpr std::size_t kKept = 3; // sets: one being written, the last one in a caller's hands, and one that it keeps a little longer

    [[nodiscard]] AnswerArrays make_arrays() const;
    [[nodiscard]] SetPtr make_set() const;
    [[nodiscard]] SetPtr find_free();
    [[nodiscard]] py::dict make_infos(const py::array& outcome, const py::array& success) const;

    py::ssize_t count_, observation_size_, devices_;
    std::array<py::ssize_t, 3> picture_;
    bool copy_;
    py::dtype row_;
    std::vector<Field> fields_;
    py::str success_key_{"success"};
    py::dict masks_; // "_key": all true, for every field and the success
    std::vector<SetPtr> sets_;
    std::size_t oldest_ = 0;
    SetPtr last_;
    py::array_t<float> final_observation_;
    py::array_t<std::uint8_t> final_pixels_;
    AnswerArrays views_; // of last_, without copies
    py::dict view_infos_;
};

} // namespace trocar::python
