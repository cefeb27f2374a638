// SPDX-License-Identifier: BSD-3-Clause
// NumPy's memory as the library's arrays, without a copy where nobody can write to it any more.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "delassus/array.hpp"

namespace delassus::python {

namespace py = pybind11;

/// Keeps a Python object alive as long as the pointer or a copy of it lives. Released on any thread, with or without
/// the GIL; left alone where Python has ended.
inline std::shared_ptr<const void> kept_alive(py::object object) {
    return {object.release().ptr(), [](const void* kept) {
                if (!Py_IsInitialized()) return;
                const py::gil_scoped_acquire with_gil;
                Py_DECREF(static_cast<PyObject*>(const_cast<void*>(kept)));
            }};
}

/// Whether it is a Problem of the package, whose views never change (problems.hpp).
bool is_problem(const py::object& object);

/// Lends the memory of NumPy's arrays to a problem. What is lent is read-only from then on, down to the array that owns
/// the memory: solvers trust the hash of the values and keep factors of them. Unless keep() is called, the arrays
/// become as they were when this ends.
class Lender {
public:
    /// copy: lend nothing.
    explicit Lender(bool copy) : copy_(copy) {}
    ~Lender() {
        // Owners before their views, as NumPy asks.
        for (auto array = made_read_only_.rbegin(); array != made_read_only_.rend(); ++array)
            set_writeable(*array, true);
    }
    Lender(const Lender&) = delete;
    Lender& operator=(const Lender&) = delete;
    void keep() { made_read_only_.clear(); }

    /// The values of a contiguous array of this type: borrowed if all of the memory could be made read-only, else a
    /// copy.
    template <typename Value>
    Array<Value> values_of(const py::array& array) {
        const auto* data = static_cast<const Value*>(array.data());
        const auto size = static_cast<std::size_t>(array.size());
        if (copy_ || reinterpret_cast<std::uintptr_t>(data) % alignof(Value) != 0 || !make_read_only(array))
            return {data, data + size};
        return Array<Value>::borrowed(data, size, kept_alive(array));
    }

private:
    /// Whether nobody can write to the memory of the array: it owns it, or it is a view, through others perhaps, of an
    /// array that is read-only or that nobody else refers to; and so can be made read-only. Memory of other owners than
    /// NumPy's (of PyTorch, of a file) may change.
    bool make_read_only(const py::array& array) {
        std::vector<py::array> writeable;
        for (py::array view = array;;) {
            if (view.writeable()) writeable.push_back(view);
            if (view.owndata()) break;
            const py::object base = view.base();
            if (!base) return false;
            if (!py::isinstance<py::array>(base)) {
                if (!writeable.empty() || !is_problem(base)) return false;
                break;
            }
            const auto owner = py::reinterpret_borrow<py::array>(base);
            // The view's reference, base and owner are three.
            if (owner.writeable() && Py_REFCNT(owner.ptr()) > 3) return false;
            view = owner;
        }
        for (const py::array& view : writeable) {
            set_writeable(view, false);
            made_read_only_.push_back(view);
        }
        return true;
    }
    static void set_writeable(const py::array& array, bool on) { array.attr("setflags")(py::arg("write") = on); }

    bool copy_;
    std::vector<py::array> made_read_only_;
};

}  // namespace delassus::python
