// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/communicator.hpp"

#include <cstdlib>

#include "delassus/distributed.hpp"
#include "delassus/error.hpp"
#include "support/module.hpp"
#include "support/mpi_module.hpp"
#include "support/sentence.hpp"

namespace delassus {

Communicator::~Communicator() = default;

namespace {

class SingleProcess : public Communicator {
public:
    [[nodiscard]] int rank() const override { return 0; }
    [[nodiscard]] int size() const override { return 1; }
    [[nodiscard]] std::int32_t handle() const override { return 0; }
    void sum(std::span<double>) const override {}
    void sum(std::span<std::int64_t>) const override {}
    void max(std::span<double>) const override {}
    void max(std::span<std::int64_t>) const override {}
    [[nodiscard]] std::vector<std::int64_t> all(std::int64_t value) const override { return {value}; }
    [[nodiscard]] std::vector<std::vector<std::byte>> exchange(
        const std::vector<std::vector<std::byte>>& to) const override {
        return to;
    }
    [[nodiscard]] std::string broadcast(const std::string& text, int) const override { return text; }
    [[nodiscard]] std::int64_t bytes_sent() const override { return 0; }
    [[noreturn]] void abort(int exit_code) const override { std::_Exit(exit_code); }
};

}  // namespace

std::shared_ptr<const Communicator> single_process() {
    return std::make_shared<SingleProcess>();
}

std::shared_ptr<const Communicator> communicator_of_run() {
    if (process_count() == 1) return single_process();
    const auto make = reinterpret_cast<DelassusMpiMake>(module_symbol(
        "delassus_mpi", "delassus_mpi_make", "several processes cannot share a problem", "MPI", "; start one process"));
    std::shared_ptr<const Communicator> communicator;
    make(communicator);
    return communicator;
}

void together(const Communicator& communicator, const std::function<void()>& body) {
    if (communicator.size() == 1) return body();
    std::string sentence;
    bool failed = false;
    try {
        body();
    } catch (const std::exception& error) {
        failed = true;
        sentence = sentence_of(error);
    }
    const auto failures = communicator.all(failed ? 1 : 0);
    for (int rank = 0; rank < communicator.size(); ++rank)
        if (failures[static_cast<std::size_t>(rank)] != 0) throw InputError(communicator.broadcast(sentence, rank));
}

}  // namespace delassus
