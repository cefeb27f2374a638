// SPDX-License-Identifier: BSD-3-Clause
// The worker's side of the pipe: one line of JSON for each event.
#pragma once

#include <unistd.h>

#include <cerrno>
#include <string>
#include <string_view>

#include "bench/json_text.hpp"
#include "delassus/error.hpp"

namespace delassus::bench {

class Channel {
public:
    static constexpr int silent = -1;  ///< in place of a descriptor: of a process that does not speak
    explicit Channel(int descriptor) : descriptor_(descriptor) {}

    void send(const char* event, Json fields = Json::object()) const {
        Json line = {{"event", event}};
        line.update(fields);
        write_all(json_text(line) + "\n");
    }

    /// The event "failed" of a worker whose memory does not suffice; needs none itself.
    void send_out_of_memory() const {
        write_all("{\"event\":\"failed\",\"kind\":\"memory\",\"message\":\"out of memory\"}\n");
    }

private:
    void write_all(std::string_view text) const {
        while (descriptor_ != silent && !text.empty()) {
            const ssize_t written = write(descriptor_, text.data(), text.size());
            if (written < 0 && errno != EINTR)
                throw Error("the process that started the worker no longer reads from it");
            if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
        }
    }

    int descriptor_;
};

}  // namespace delassus::bench
