// SPDX-License-Identifier: BSD-3-Clause
#include "relations/worker.hpp"

#include <chrono>
#include <exception>
#include <filesystem>
#include <vector>

#include "bench/channel.hpp"
#include "delassus/registry.hpp"
#include "process/child_process.hpp"
#include "process/stdout_guard.hpp"
#include "process/supervision.hpp"
#include "relations/random_scene.hpp"
#include "relations/relations.hpp"
#include "support/sentence.hpp"

namespace delassus::relations {
namespace {

void answer(const Json& request, const bench::Channel& channel) {
    std::vector<std::filesystem::path> folders;
    for (const auto& folder : request.at("plugin_path")) folders.emplace_back(folder.get<std::string>());
    const Registry registry(folders);
    JudgeOrder order;
    order.run_limit = request.at("run_limit");
    order.command = own_program();
    order.scratch = request.at("scratch").get<std::string>();
    for (const auto& name : request.at("only")) order.only.insert(name.get<std::string>());
    order.still_alive = [&] { channel.send("alive"); };
    order.interrupted = interrupted;

    const auto judge = [&](const Json& scene, std::uint64_t number) {
        channel.send("begin", {{"number", number}});
        const auto begin = std::chrono::steady_clock::now();
        Json outcomes = Json::array();
        for (const auto& outcome : judge_scene(scene, registry, order))
            outcomes.push_back(
                {{"relation", outcome.relation}, {"verdict", name_of(outcome.verdict)}, {"detail", outcome.detail}});
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
        if (!interrupted())
            channel.send("judged", {{"number", number}, {"seconds", taken.count()}, {"outcomes", outcomes}});
    };
    if (request.contains("scenes")) {
        for (std::size_t k = 0; k < request["scenes"].size() && !interrupted(); ++k) judge(request["scenes"][k], k);
    } else {
        for (const auto& number : request.at("numbers")) {
            if (interrupted()) break;
            judge(random_scene(request.at("seed"), number), number);
        }
    }
}

}  // namespace

int run_worker(const std::string& request, int descriptor) {
    install_interrupt_handler();
    const bench::Channel channel(descriptor);
    const StdoutGuard guard;
    try {
        answer(parse_ordered_json(request), channel);
        channel.send("done");
        return 0;
    } catch (const std::bad_alloc&) {
        channel.send_out_of_memory();
        return 2;
    } catch (const std::exception& error) {
        channel.send("failed", {{"message", sentence_of(error)}});
        return 2;
    }
}

}  // namespace delassus::relations
