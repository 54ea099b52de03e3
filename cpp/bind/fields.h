// Reads structs from Python dicts and says what is wrong with them.
#pragma once

#include "base/vec.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <nanobind/nanobind.h>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace mlrt {

[[noreturn]] inline void refuse_value(const std::string &sentence) {
    throw nanobind::value_error(sentence.c_str());
}

[[noreturn]] inline void refuse_type(const std::string &sentence) {
    throw nanobind::type_error(sentence.c_str());
}

// A name of an enumerator and its value.
template <typename Enum>
using EnumNames = std::vector<std::pair<const char *, Enum>>;

// The enumerator of this name; `what` says in a refusal what is named.
template <typename Enum>
Enum enumerator_of(const EnumNames<Enum> &names, const std::string &name,
                   const std::string &what) {
    std::string known;
    for (const auto &[candidate, result] : names) {
        if (name == candidate)
            return result;
        known += (known.empty() ? "" : ", ") + std::string(candidate);
    }
    refuse_value(what + " must be one of: " + known + ".");
}

// One dict. Its keys are the names of a struct's fields; `finish` refuses those that nobody
// read.
class Fields {
public:
    Fields(nanobind::handle dict, std::string name) : name_(std::move(name)) {
        if (!nanobind::isinstance<nanobind::dict>(dict))
            refuse_type(name_ + " must be a dict.");
        dict_ = nanobind::borrow<nanobind::dict>(dict);
    }

    bool has(const char *key) const { return dict_.contains(key); }

    float number(const char *key) { return to_number(value(key), path(key)); }
    float number(const char *key, float otherwise) {
        return has(key) ? number(key) : otherwise;
    }

    bool boolean(const char *key, bool otherwise) {
        if (!has(key))
            return otherwise;
        const nanobind::object given = value(key);
        const int truth = PyBool_Check(given.ptr()) || PyIndex_Check(given.ptr())
                              ? PyObject_IsTrue(given.ptr())
                              : -1;
        if (truth < 0)
            refuse_type(path(key) + " must be a bool.");
        return truth == 1;
    }

    // An integer in [0, limit].
    uint32_t integer(const char *key, uint32_t limit = 0xffffffffu) {
        const nanobind::object given = value(key);
        const long long result = PyIndex_Check(given.ptr()) ? to_long(given) : -1;
        if (!PyIndex_Check(given.ptr()))
            refuse_type(path(key) + " must be an integer.");
        if (result < 0 || result > (long long)(limit))
            refuse_value(path(key) + " must be from 0 to " + std::to_string(limit) + ".");
        return uint32_t(result);
    }
    uint32_t integer_or(const char *key, uint32_t otherwise, uint32_t limit = 0xffffffffu) {
        return has(key) ? integer(key, limit) : otherwise;
    }

    // An index below `count`, or `none` if it is missing, None, -1 or 2^32 - 1.
    uint32_t index(const char *key, size_t count, uint32_t none) {
        if (!has(key))
            return none;
        const nanobind::object given = value(key);
        if (given.is_none())
            return none;
        if (!PyIndex_Check(given.ptr()))
            refuse_type(path(key) + " must be an index or None.");
        const long long result = to_long(given);
        if (result == -1 || result == (long long)(none))
            return none;
        if (result < 0 || size_t(result) >= count)
            refuse_value(path(key) + " is " + std::to_string(result) + ", but there are " +
                         std::to_string(count) + " to refer to.");
        return uint32_t(result);
    }

    Vec3f vector(const char *key) { return to_vector(value(key), path(key)); }
    Vec3f vector(const char *key, Vec3f otherwise) {
        return has(key) ? vector(key) : otherwise;
    }

    Vec2f vector2(const char *key, Vec2f otherwise) {
        if (!has(key))
            return otherwise;
        const nanobind::object given = value(key);
        require_length(given, 2, path(key));
        return {to_number(given[0], path(key)), to_number(given[1], path(key))};
    }

    std::array<Vec3f, 3> vectors(const char *key) {
        const nanobind::object given = value(key);
        require_length(given, 3, path(key));
        return {to_vector(given[0], path(key)), to_vector(given[1], path(key)),
                to_vector(given[2], path(key))};
    }

    template <typename Enum>
    Enum choice(const char *key, const EnumNames<Enum> &names) {
        const nanobind::object given = value(key);
        const std::string text =
            nanobind::isinstance<nanobind::str>(given)
                ? std::string(nanobind::borrow<nanobind::str>(given).c_str())
                : std::string();
        return enumerator_of(names, text, path(key));
    }
    template <typename Enum>
    Enum choice(const char *key, const EnumNames<Enum> &names, Enum otherwise) {
        return has(key) ? choice(key, names) : otherwise;
    }

    // Whatever is there, for the caller to look into.
    nanobind::object object(const char *key) { return value(key); }

    // Refuses keys that were not asked for.
    void finish() const {
        for (const auto &[key, unused] : dict_) {
            const std::string text = nanobind::str(key).c_str();
            if (!read_.contains(text))
                refuse_value(name_ + " has no field '" + text + "'.");
        }
    }

    std::string path(const char *key) const { return name_ + "['" + key + "']"; }

private:
    nanobind::object value(const char *key) {
        if (!has(key))
            refuse_value(name_ + " lacks '" + std::string(key) + "'.");
        read_.insert(key);
        return dict_[key];
    }

    static long long to_long(const nanobind::object &given) {
        const nanobind::object number =
            nanobind::steal<nanobind::object>(PyNumber_Index(given.ptr()));
        if (!number.is_valid())
            throw nanobind::python_error();
        int overflow = 0;
        const long long result = PyLong_AsLongLongAndOverflow(number.ptr(), &overflow);
        return overflow ? -2 : result; // refused by every caller
    }

    static float to_number(const nanobind::object &given, const std::string &path) {
        const double result = PyFloat_AsDouble(given.ptr());
        if (result == -1.0 && PyErr_Occurred()) {
            PyErr_Clear();
            refuse_type(path + " must be a number.");
        }
        if (!std::isfinite(float(result)))
            refuse_value(path + " must be finite in single precision.");
        return float(result);
    }

    static void require_length(const nanobind::object &given, size_t length,
                               const std::string &path) {
        const Py_ssize_t size =
            PySequence_Check(given.ptr()) ? PySequence_Size(given.ptr()) : -1;
        if (size < 0) {
            PyErr_Clear();
            refuse_type(path + " must be a sequence.");
        }
        if (size_t(size) != length)
            refuse_value(path + " must have " + std::to_string(length) + " elements, not " +
                         std::to_string(size) + ".");
    }

    static Vec3f to_vector(const nanobind::object &given, const std::string &path) {
        require_length(given, 3, path);
        return {to_number(given[0], path), to_number(given[1], path),
                to_number(given[2], path)};
    }

    std::string name_;
    nanobind::dict dict_;
    std::set<std::string> read_;
};

} // namespace mlrt
