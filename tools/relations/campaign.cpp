// SPDX-License-Identifier: BSD-3-Clause
#include "relations/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <fstream>
#include <map>
#include <mutex>
#include <thread>

#include "delassus/error.hpp"
#include "relations/random_scene.hpp"
#include "relations/relations.hpp"
#include "relations/shrink.hpp"

namespace delassus::relations {
namespace {

constexpr std::array<Verdict, 7> verdicts = {Verdict::Held,     Verdict::Chaotic,        Verdict::Reported,
                                             Verdict::Violated, Verdict::OnlyOneRefused, Verdict::NotJudged,
                                             Verdict::TooLong};
/// Scenes that a process judges before the next one starts: its start takes some 0.05 s.
constexpr std::uint64_t scenes_of_a_process = 8;

class Tally {
public:
    Tally(const Campaign& campaign, OutputFolder& output, const std::function<void(const CampaignCounts&)>& told)
        : campaign_(campaign), output_(output), told_(told), lines_(output.add("results.jsonl")) {}

    /// Takes an answer; the failures in it that are to be shrunk.
    std::vector<Told> take(const ScenesAnswer& answer) {
        const std::lock_guard lock(mutex_);
        ++counts_.scenes;
        seconds_ += answer.seconds;
        Json outcomes = Json::object();
        std::vector<Told> failures;
        for (const auto& told : answer.outcomes) {
            ++table_[told.relation][told.verdict];
            outcomes[told.relation] = told.detail.empty() ? Json(told.verdict) : Json({told.verdict, told.detail});
            const bool violated = told.verdict == name_of(Verdict::Violated);
            if (!violated && told.verdict != name_of(Verdict::OnlyOneRefused)) continue;
            counts_.violated += violated ? 1 : 0;
            failures.push_back(told);
        }
        lines_ << json_text({{"seed", campaign_.seed},
                             {"scene", answer.number},
                             {"seconds", answer.seconds},
                             {"outcomes", outcomes}})
               << std::endl;
        if (!lines_) throw Error((output_.path() / "results.jsonl").string() + " cannot be written");
        if (told_) told_(counts_);
        const auto now = std::chrono::steady_clock::now();
        if (now - written_ > std::chrono::seconds(10)) write();
        return failures;
    }

    void add_failure(std::uint64_t number, const std::string& relation, const Shrunk& left) {
        const std::lock_guard lock(mutex_);
        const std::string file = fmt::format("{}_{}_{}.yaml", relation, campaign_.seed, number);
        const std::vector<std::string> head = {
            fmt::format("The relation \"{}\" is violated: {}.", relation, meaning_of(relation)), left.detail,
            fmt::format("See it with: delassus bench run relations --scene {} --only {}", file, relation),
            fmt::format("Shrunk from scene {} of seed {}.", number, campaign_.seed)};
        output_.write("failures/" + file, scene_yaml(left.scene, head));
    }

    void write() {
        output_.write("summary.md", summary());
        written_ = std::chrono::steady_clock::now();
    }

    [[nodiscard]] CampaignCounts counts() {
        const std::lock_guard lock(mutex_);
        return counts_;
    }

private:
    [[nodiscard]] std::string summary() const {
        std::string text = fmt::format(
            "# Relations\n\n{} random scenes of seed {}, from counter {} on; {:.3g} s a scene. {} violations.\n\n"
            "| relation | {} | {} | {} | {} | {} | {} | {} |\n|---|--:|--:|--:|--:|--:|--:|--:|\n",
            counts_.scenes, campaign_.seed, campaign_.first,
            seconds_ / static_cast<double>(std::max<std::uint64_t>(1, counts_.scenes)), counts_.violated,
            name_of(verdicts[0]), name_of(verdicts[1]), name_of(verdicts[2]), name_of(verdicts[3]),
            name_of(verdicts[4]), name_of(verdicts[5]), name_of(verdicts[6]));
        for (const auto relation : relation_names) {
            const auto row = table_.find(std::string(relation));
            if (row == table_.end()) continue;
            text += fmt::format("| {} |", relation);
            for (const Verdict verdict : verdicts) {
                const auto found = row->second.find(std::string(name_of(verdict)));
                text += fmt::format(" {} |", found == row->second.end() ? 0 : found->second);
            }
            text += "\n";
        }
        text += "\n";
        for (const auto relation : relation_names) text += fmt::format("- {}: {}.\n", relation, meaning_of(relation));
        return text;
    }

    const Campaign& campaign_;
    OutputFolder& output_;
    const std::function<void(const CampaignCounts&)>& told_;
    std::mutex mutex_;
    CampaignCounts counts_;
    double seconds_ = 0.0;
    std::ofstream lines_;
    std::map<std::string, std::map<std::string, std::uint64_t>, std::less<>> table_;
    std::chrono::steady_clock::time_point written_ = std::chrono::steady_clock::now();
};

/// Counters, handed out in blocks until the time or the count is over.
class Blocks {
public:
    explicit Blocks(const Campaign& campaign)
        : campaign_(campaign), begin_(std::chrono::steady_clock::now()), next_(campaign.first) {}

    std::vector<std::uint64_t> next() {
        const std::lock_guard lock(mutex_);
        std::vector<std::uint64_t> block;
        if (over()) return block;
        for (const std::uint64_t end = campaign_.first + campaign_.count;
             next_ < end && block.size() < scenes_of_a_process;)
            block.push_back(next_++);
        return block;
    }
    [[nodiscard]] bool over() const {
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin_;
        return taken.count() > campaign_.seconds || (campaign_.settings.cancelled && campaign_.settings.cancelled());
    }

private:
    const Campaign& campaign_;
    std::chrono::steady_clock::time_point begin_;
    std::mutex mutex_;
    std::uint64_t next_;
};

void work(const Campaign& campaign, const ApartSettings& settings, Blocks& blocks, Tally& tally) {
    for (auto block = blocks.next(); !block.empty(); block = blocks.next())
        judge_random(settings, campaign.seed, block, campaign.only, [&](const ScenesAnswer& answer) {
            for (const auto& told : tally.take(answer)) {
                const Json scene = random_scene(campaign.seed, answer.number);
                tally.add_failure(answer.number, told.relation,
                                  campaign.shrink_seconds > 0.0 ? shrunk(settings, scene, told, campaign.shrink_seconds)
                                                                : Shrunk{scene, told.detail});
            }
            return !blocks.over();
        });
}

}  // namespace

CampaignCounts run_campaign(const Campaign& campaign, OutputFolder& output,
                            const std::function<void(const CampaignCounts&)>& told) {
    output.clear();
    output.add_folder("failures");
    output.keep();
    Tally tally(campaign, output, told);
    Blocks blocks(campaign);
    std::mutex mutex;
    std::exception_ptr failure;
    std::vector<std::thread> threads;
    for (int job = 0; job < campaign.jobs; ++job) {
        ApartSettings settings = campaign.settings;
        settings.scratch /= fmt::format("{}", job);
        std::filesystem::create_directories(settings.scratch);
        threads.emplace_back([&, settings] {
            try {
                work(campaign, settings, blocks, tally);
            } catch (...) {
                const std::lock_guard lock(mutex);
                failure = std::current_exception();
            }
        });
    }
    for (auto& thread : threads) thread.join();
    tally.write();
    if (failure) std::rethrow_exception(failure);
    CampaignCounts counts = tally.counts();
    counts.interrupted = campaign.settings.cancelled && campaign.settings.cancelled();
    return counts;
}

FileAnswer judge_file(const ApartSettings& settings, const std::filesystem::path& file,
                      const std::vector<std::string>& only) {
    FileAnswer result;
    const auto systems = read_systems(file);
    std::vector<Json> documents;
    for (const auto& system : systems) documents.push_back(system.scene);
    judge_documents(settings, documents, only, [&](const ScenesAnswer& answer) {
        for (const auto& told : answer.outcomes) {
            if (systems.size() > 1) result.text += systems[answer.number].name + ": ";
            result.text +=
                fmt::format("{}: {}{}{}\n", told.relation, told.verdict, told.detail.empty() ? "" : ": ", told.detail);
            result.violated += told.verdict == name_of(Verdict::Violated) ? 1 : 0;
        }
        return true;
    });
    return result;
}

}  // namespace delassus::relations
