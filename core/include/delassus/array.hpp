// SPDX-License-Identifier: BSD-3-Clause
// Numbers that a problem owns, or reads where somebody else keeps them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

namespace delassus {

/// A vector of numbers that can borrow its memory: Array::borrowed() reads an owner's memory without copying it, and
/// keeps the owner alive. A copy of what is borrowed borrows, too. Whatever may write, which is everything that is not
/// const, first copies what is borrowed into memory of its own; so reading through a const reference never copies, and
/// nothing writes to the owner's memory. The owner must not write to it either as long as an Array has it.
///
/// Otherwise as std::vector, from which and to which it converts; to a std::span without a copy.
template <typename Value>
class Array {
public:
    using value_type = Value;
    using size_type = std::size_t;
    using difference_type = std::ptrdiff_t;
    using reference = Value&;
    using const_reference = const Value&;
    using pointer = Value*;
    using const_pointer = const Value*;
    using iterator = Value*;
    using const_iterator = const Value*;

    Array() noexcept = default;
    Array(std::initializer_list<Value> values) : own_(values) { show_own(); }
    explicit Array(std::size_t size, Value value = Value()) : own_(size, value) { show_own(); }
    template <std::input_iterator Iterator>
    Array(Iterator first, Iterator last) : own_(first, last) {
        show_own();
    }
    Array(std::vector<Value> values) noexcept : own_(std::move(values)) { show_own(); }
    Array(const Array& other) : own_(other.own_), owner_(other.owner_) { show_as(other); }
    Array(Array&& other) noexcept : own_(std::move(other.own_)), owner_(std::move(other.owner_)) {
        show_as(other);
        other.forget();
    }
    ~Array() = default;
    Array& operator=(const Array& other) {
        if (this == &other) return *this;
        own_ = other.own_;  // in the memory that is there, if it is enough
        owner_ = other.owner_;
        show_as(other);
        return *this;
    }
    Array& operator=(Array&& other) noexcept {
        if (this == &other) return *this;
        own_ = std::move(other.own_);
        owner_ = std::move(other.owner_);
        show_as(other);
        other.forget();
        return *this;
    }
    Array& operator=(std::vector<Value> values) noexcept {
        own_ = std::move(values);
        return show_own();
    }
    Array& operator=(std::initializer_list<Value> values) {
        own_ = values;
        return show_own();
    }

    /// An array in the owner's memory of `size` values, which stays and keeps its values as long as the owner lives.
    [[nodiscard]] static Array borrowed(const Value* data, std::size_t size, std::shared_ptr<const void> owner) {
        return Array(data, size, std::move(owner));
    }
    /// A copy.
    operator std::vector<Value>() const { return {begin(), end()}; }
    [[nodiscard]] bool borrows() const noexcept { return owner_ != nullptr; }
    /// Hands the memory to an owner of its own, from which this array and its copies then borrow.
    void share() {
        if (borrows()) return;
        auto owner = std::make_shared<const std::vector<Value>>(std::move(own_));
        const auto* values = owner->data();
        const auto size = owner->size();
        *this = borrowed(values, size, std::move(owner));
    }

    [[nodiscard]] std::size_t size() const noexcept { return size_; }
    [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
    [[nodiscard]] const Value* data() const noexcept { return data_; }
    [[nodiscard]] const Value* begin() const noexcept { return data_; }
    [[nodiscard]] const Value* end() const noexcept { return data_ + size_; }
    [[nodiscard]] const Value* cbegin() const noexcept { return data_; }
    [[nodiscard]] const Value* cend() const noexcept { return data_ + size_; }
    [[nodiscard]] const Value& operator[](std::size_t at) const { return data_[at]; }
    [[nodiscard]] const Value& at(std::size_t at) const {
        if (at >= size_) throw std::out_of_range("Array::at");
        return data_[at];
    }
    [[nodiscard]] const Value& front() const { return data_[0]; }
    [[nodiscard]] const Value& back() const { return data_[size_ - 1]; }

    [[nodiscard]] Value* data() { return own().data(); }
    [[nodiscard]] Value* begin() { return own().data(); }
    [[nodiscard]] Value* end() { return own().data() + size_; }
    [[nodiscard]] Value& operator[](std::size_t at) { return own()[at]; }
    [[nodiscard]] Value& at(std::size_t at) { return own().at(at); }
    [[nodiscard]] Value& front() { return own().front(); }
    [[nodiscard]] Value& back() { return own().back(); }

    [[nodiscard]] std::size_t capacity() const noexcept { return own_.capacity(); }
    void reserve(std::size_t size) {
        own().reserve(size);
        show_own();
    }
    void resize(std::size_t size, Value value = Value()) {
        own().resize(size, value);
        show_own();
    }
    void clear() noexcept {
        own_.clear();
        show_own();
    }
    void assign(std::size_t size, Value value) {
        own_.assign(size, value);
        show_own();
    }
    template <std::input_iterator Iterator>
    void assign(Iterator first, Iterator last) {
        own_.assign(first, last);
        show_own();
    }
    void push_back(Value value) {
        own().push_back(value);
        show_own();
    }
    void pop_back() {
        own().pop_back();
        show_own();
    }
    template <std::input_iterator Iterator>
    iterator insert(const_iterator before, Iterator first, Iterator last) {
        const auto at = before - data_;
        own().insert(own_.begin() + at, first, last);
        show_own();
        return own_.data() + at;
    }
    void swap(Array& other) noexcept {
        own_.swap(other.own_);
        owner_.swap(other.owner_);
        std::swap(data_, other.data_);
        std::swap(size_, other.size_);
    }
    void swap(std::vector<Value>& other) {
        own().swap(other);
        show_own();
    }

    friend bool operator==(const Array& one, const Array& two) {
        return std::equal(one.begin(), one.end(), two.begin(), two.end());
    }
    friend bool operator==(const Array& one, const std::vector<Value>& two) {
        return std::equal(one.begin(), one.end(), two.begin(), two.end());
    }

private:
    Array(const Value* data, std::size_t size, std::shared_ptr<const void>&& owner)
        : data_(data), size_(size), owner_(std::move(owner)) {}
    /// The vector, with what was borrowed copied into it.
    std::vector<Value>& own() {
        if (owner_) {
            own_.assign(data_, data_ + size_);
            show_own();
        }
        return own_;
    }
    Array& show_own() noexcept {
        data_ = own_.data();
        size_ = own_.size();
        owner_.reset();
        return *this;
    }
    /// After the vector and the owner were taken over.
    void show_as(const Array& other) noexcept {
        data_ = owner_ ? other.data_ : own_.data();
        size_ = other.size_;
    }
    void forget() noexcept {
        own_.clear();
        show_own();
    }

    const Value* data_ = nullptr;  ///< of the vector, or of the owner
    std::size_t size_ = 0;
    std::vector<Value> own_;             ///< without values where they are borrowed
    std::shared_ptr<const void> owner_;  ///< null where the values are its own
};

}  // namespace delassus
