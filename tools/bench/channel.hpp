// SPDX-License-Identifier: BSD-3-Clause
// The worker's side of the pipe: one line of JSON for each event.
#pragma once

#include <unistd.h>

#include <cerrno>
#include <string>

#include "bench/json_text.hpp"
#include "delassus/error.hpp"

namespace delassus::bench {

class Channel {
public:
    explicit Channel(int descriptor) : descriptor_(descriptor) {}

    void send(const char* event, Json fields = Json::object()) const {
        Json line = {{"event", event}};
        line.update(fields);
        const std::string text = text_of(line) + "\n";
        for (std::size_t sent = 0; sent < text.size();) {
            const ssize_t written = write(descriptor_, text.data() + sent, text.size() - sent);
            if (written < 0 && errno != EINTR)
                throw Error("the process that started the worker no longer reads from it");
            if (written > 0) sent += static_cast<std::size_t>(written);
        }
    }

private:
    int descriptor_;
};

}  // namespace delassus::bench
