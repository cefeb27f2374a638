// SPDX-License-Identifier: BSD-3-Clause
#include "process/terminal.hpp"

#include <sys/types.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>

namespace delassus {

namespace {

/// Writes to a descriptor what is printable; allocates nothing. Pieces may end within a character.
class Printable {
public:
    explicit Printable(int descriptor) : descriptor_(descriptor) {}

    /// False with errno set if the descriptor does not take it.
    bool write(std::string_view text) {
        for (const char c : text)
            if (!take(static_cast<unsigned char>(c))) return false;
        return flush();
    }
    /// For what is not text of others.
    bool write_raw(std::string_view text) {
        for (const char c : text)
            if (!put(c)) return false;
        return flush();
    }

private:
    bool take(unsigned char byte) {
        if (held_ > 0 && (byte & 0xc0U) == 0x80) {
            character_[held_++] = byte;
            return held_ < length_ || end_character();
        }
        if (held_ > 0 && !escape_held()) return false;  // it lacks its end
        if (byte < 0x80)
            return (byte < 0x20 && byte != '\n' && byte != '\t') || byte == 0x7f ? escape(byte) : put(byte);
        length_ = byte >= 0xc2 && byte <= 0xdf   ? 2
                  : byte >= 0xe0 && byte <= 0xef ? 3
                  : byte >= 0xf0 && byte <= 0xf4 ? 4
                                                 : 0;
        if (length_ == 0) return escape(byte);
        character_[held_++] = byte;
        return true;
    }

    /// A whole character; C1 controls and what turns the direction of text around are shown.
    bool end_character() {
        std::uint32_t code = character_[0] & (0x7fU >> length_);
        for (int k = 1; k < length_; ++k) code = code << 6U | (character_[static_cast<std::size_t>(k)] & 0x3fU);
        const bool control = code < 0xa0 || (code >= 0x202a && code <= 0x202e) || (code >= 0x2066 && code <= 0x2069);
        const bool wrong = (length_ == 3 && (code < 0x800 || (code >= 0xd800 && code <= 0xdfff))) ||
                           (length_ == 4 && (code < 0x10000 || code > 0x10ffff));
        if (control || wrong) return escape_held();
        for (int k = 0; k < held_; ++k)
            if (!put(static_cast<char>(character_[static_cast<std::size_t>(k)]))) return false;
        held_ = 0;
        return true;
    }

    bool escape_held() {
        const int count = held_;
        held_ = 0;
        for (int k = 0; k < count; ++k)
            if (!escape(character_[static_cast<std::size_t>(k)])) return false;
        return true;
    }

    bool escape(unsigned char byte) {
        constexpr std::string_view digits = "0123456789abcdef";
        return put('\\') && put('x') && put(digits[byte >> 4U]) && put(digits[byte & 15U]);
    }

    bool put(char c) {
        buffer_[filled_++] = c;
        return filled_ < buffer_.size() || flush();
    }
    bool put(unsigned char c) { return put(static_cast<char>(c)); }

    bool flush() {
        std::size_t done = 0;
        while (done < filled_) {
            const ssize_t written = ::write(descriptor_, buffer_.data() + done, filled_ - done);
            if (written < 0 && errno == EINTR) continue;
            if (written < 0) return filled_ = 0, false;
            done += static_cast<std::size_t>(written);
        }
        filled_ = 0;
        return true;
    }

    int descriptor_;
    std::array<unsigned char, 4> character_{};
    int held_ = 0, length_ = 0;
    std::array<char, 4096> buffer_;
    std::size_t filled_ = 0;
};

ssize_t write_printable(void* cookie, const char* text, std::size_t size) {
    return static_cast<Printable*>(cookie)->write({text, size}) ? static_cast<ssize_t>(size) : 0;
}

/// A stream in place of one of the standard ones, which the C library allows; null if there is no memory for it.
std::FILE* printable_stream(Printable& printable, int buffering) {
    std::FILE* stream = fopencookie(&printable, "w", {nullptr, write_printable, nullptr, nullptr});
    if (stream) std::setvbuf(stream, nullptr, buffering, BUFSIZ);
    return stream;
}

}  // namespace

void make_output_printable() {
    static Printable output(STDOUT_FILENO), errors(STDERR_FILENO);
    if (std::FILE* stream = printable_stream(output, isatty(STDOUT_FILENO) != 0 ? _IOLBF : _IOFBF)) stdout = stream;
    if (std::FILE* stream = printable_stream(errors, _IONBF)) stderr = stream;
}

void show_line(std::string_view text) {
    Printable terminal(STDERR_FILENO);
    static_cast<void>(terminal.write_raw("\r\033[K") && terminal.write(text));
}

}  // namespace delassus
