// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "delassus/problem.hpp"

namespace delassus::tests {

/// Equality of every bit: −0 is not 0 here.
inline bool same_bits(std::span<const double> left, std::span<const double> right) {
    return left.size() == right.size() &&
           (left.empty() || std::memcmp(left.data(), right.data(), left.size() * sizeof(double)) == 0);
}

inline void expect_same(const SparseMatrix& left, const SparseMatrix& right, const char* name) {
    EXPECT_EQ(left.rows, right.rows) << name;
    EXPECT_EQ(left.columns, right.columns) << name;
    EXPECT_EQ(left.row_start, right.row_start) << name;
    EXPECT_EQ(left.column, right.column) << name;
    EXPECT_TRUE(same_bits(left.value, right.value)) << name;
}

/// All but the name, which follows the file.
inline void expect_same(const Problem& left, const Problem& right) {
    expect_same(left.H, right.H, "H");
    expect_same(left.D, right.D, "D");
    expect_same(left.E, right.E, "E");
    EXPECT_TRUE(same_bits(left.a, right.a));
    EXPECT_TRUE(same_bits(left.b, right.b));
    ASSERT_EQ(left.cones.size(), right.cones.size());
    for (std::size_t c = 0; c < left.cones.size(); ++c) {
        EXPECT_EQ(left.cones[c].kind, right.cones[c].kind) << c;
        EXPECT_EQ(left.cones[c].rows, right.cones[c].rows) << c;
        const auto &l = left.cones[c].parameters, &r = right.cones[c].parameters;
        EXPECT_TRUE(same_bits({l.begin(), l.end()}, {r.begin(), r.end()})) << c;
        EXPECT_TRUE(same_bits(left.cones[c].lo, right.cones[c].lo)) << c;
        EXPECT_TRUE(same_bits(left.cones[c].hi, right.cones[c].hi)) << c;
    }
    EXPECT_EQ(left.law, right.law);
    EXPECT_EQ(left.source, right.source);
    EXPECT_EQ(left.notes, right.notes);
}

/// Runs the action, which must throw the exception, and returns its sentence.
template <class Exception, class Action>
std::string sentence_of(Action action) {
    try {
        action();
    } catch (const Exception& error) {
        return error.what();
    }
    ADD_FAILURE() << "nothing was thrown";
    return {};
}

/// One sentence: it ends with a full stop, is one line, and holds all the words, which '|' separates.
inline void expect_sentence(const std::string& sentence, const std::string& words) {
    EXPECT_FALSE(sentence.empty());
    if (sentence.empty()) return;
    EXPECT_EQ(sentence.back(), '.') << sentence;
    EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
    for (std::size_t begin = 0; begin <= words.size();) {
        const std::size_t end = std::min(words.find('|', begin), words.size());
        EXPECT_NE(sentence.find(words.substr(begin, end - begin)), std::string::npos)
            << "\"" << words.substr(begin, end - begin) << "\" is not in: " << sentence;
        begin = end + 1;
    }
}

}  // namespace delassus::tests
