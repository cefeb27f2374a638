// SPDX-License-Identifier: BSD-3-Clause
#include "bench/expression.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "bench/key.hpp"
#include "delassus/error.hpp"

namespace delassus::bench {

namespace {

/// sum = product {(+|−) product};  product = power {(*|/) power};  power = atom [^ power];
/// atom = number | value | ( sum ) | − power
class Reader {
public:
    Reader(const std::string& text, std::size_t begin, double value) : text_(text), at_(begin), value_(value) {}

    /// Up to and with the closing parenthesis of $( … ).
    double read() {
        const double result = sum();
        expect(')');
        if (!std::isfinite(result)) refuse("is not finite");
        return result;
    }
    [[nodiscard]] std::size_t end() const { return at_; }

private:
    [[noreturn]] void refuse(const char* why) const {
        throw InputError(
            fmt::format("the formula in \"{}\" {}: it is made of numbers and \"value\" with + - * / ^ and parentheses",
                        text_, why));
    }
    char next() {
        while (at_ < text_.size() && text_[at_] == ' ') ++at_;
        return at_ < text_.size() ? text_[at_] : '\0';
    }
    void expect(char wanted) {
        if (next() != wanted) refuse(at_ < text_.size() ? "cannot be read" : "has no end");
        ++at_;
    }
    double sum() {
        double result = product();
        for (char sign = next(); sign == '+' || sign == '-'; sign = next()) {
            ++at_;
            result += sign == '+' ? product() : -product();
        }
        return result;
    }
    double product() {
        double result = power();
        for (char sign = next(); sign == '*' || sign == '/'; sign = next()) {
            ++at_;
            const double other = power();
            result = sign == '*' ? result * other : result / other;
        }
        return result;
    }
    double power() {
        const double base = atom();
        if (next() != '^') return base;
        ++at_;
        return std::pow(base, power());
    }
    double atom() {
        const char first = next();
        if (first == '-') {
            ++at_;
            return -power();
        }
        if (first == '(') {
            ++at_;
            const double result = sum();
            expect(')');
            return result;
        }
        if (text_.compare(at_, 5, "value") == 0) {
            at_ += 5;
            return value_;
        }
        double number = 0.0;
        const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), number);
        if (error != std::errc{}) refuse("cannot be read");
        at_ = static_cast<std::size_t>(end - text_.data());
        return number;
    }

    const std::string& text_;
    std::size_t at_;
    double value_;
};

}  // namespace

std::string fill_in(const std::string& text, double value) {
    std::string result;
    std::size_t begin = 0;
    for (std::size_t mark; (mark = text.find("$(", begin)) != std::string::npos;) {
        Reader reader(text, mark + 2, value);
        result += text.substr(begin, mark - begin) + digits(reader.read());
        begin = reader.end();
    }
    return result + text.substr(begin);
}

}  // namespace delassus::bench
