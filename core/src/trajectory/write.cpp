// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <type_traits>
#include <utility>
#include <variant>

#include "delassus/error.hpp"
#include "delassus/export.hpp"
#include "hdf5/isolated.hpp"
#include "output/trajectory.hpp"
#include "simulation/step_columns.hpp"
#include "trajectory/datasets.hpp"
#include "trajectory/model_file.hpp"

namespace delassus::trajectory {
namespace {

using hdf5::Handle;

class SystemFile {
public:
    /// file: the open file's name, which outlives this.
    /// unflushed: bytes that were written since the last flush; it outlives this.
    SystemFile(hid_t open_file, hid_t parent, const TrajectorySystem& system, bool resume, const std::string& file,
               std::uint64_t& unflushed)
        : file_(open_file), name_(file), unflushed_(unflushed) {
        const Handle group = group_in(parent, system.name.c_str(), resume, file);
        if (!resume) {
            put_text(group.get(), "integrator", system.integrator, file);
            put_text(group.get(), "solver", system.solver, file);
            put_number(group.get(), "step", system.step, file);
            put_texts(group.get(), "bodies", system.model.bodies, file);
            write_model(group.get(), system.model, file);
        }
        const Handle steps = group_in(group.get(), "steps", resume, file);
        const auto step = [&](const Column& column, std::vector<hsize_t> shape = {}) {
            steps_.emplace_back(steps.get(), column, std::move(shape), resume, system.steps, file);
        };
        steps_.reserve(step_columns.size());
        for (const StepColumn& column : step_columns)
            if (column.stored)
                step({column.name, column.unit, column.description, column.integer()},
                     column.width() == 1 ? std::vector<hsize_t>{} : std::vector<hsize_t>{column.width()});
        const Handle frames = group_in(group.get(), "frames", resume, file);
        const auto frame = [&](const Column& column, std::vector<hsize_t> shape = {}) {
            frames_.emplace_back(frames.get(), column, std::move(shape), resume, system.frames, file);
        };
        frames_.reserve(5);
        frame({"t", "s", "time"});
        if (system.positions > 0) {
            frame({"q", "m, 1", "positions: mass centre and unit quaternion w x y z of moving bodies, then nodes"},
                  {static_cast<hsize_t>(system.positions)});
            frame({"v", "m/s, rad/s", "velocities: of the mass centre, angular in the body frame; then nodes"},
                  {static_cast<hsize_t>(system.velocities)});
        }
        if (!system.model.bodies.empty())
            frame({"poses", "m, 1", "mass centre and unit quaternion w x y z of every body, fixed ones too"},
                  {system.model.bodies.size(), 7});
        frame({"contact_end", "1", "where the contacts of the frame end in contacts/point", true});
        const Handle contacts = group_in(group.get(), "contacts", resume, file);
        contacts_before_ = static_cast<std::int64_t>(frames_.back().last());
        contacts_.reserve(5);
        const auto contact = [&](const Column& column, std::vector<hsize_t> shape = {}) {
            contacts_.emplace_back(contacts.get(), column, std::move(shape), resume, contacts_before_, file);
        };
        contact({"point", "m", "midway between the two surfaces"}, {3});
        contact({"normal", "1", "unit vector from the first surface to the second"}, {3});
        contact({"gap", "m", "distance of the surfaces where the step began; negative in penetration"});
        if (!system.contact_forces) return;
        contact({"bodies", "1", "of the first and the second surface, -1 the world; nodes are counted on after bodies",
                 true},
                {2});
        contact({"force", "N", "mean force of the step on the second, world frame; on the first the opposite"}, {3});
    }

    void add_step(const StepRecord& record) {
        auto series = steps_.begin();
        const auto add = [&](auto member) {
            if constexpr (std::is_same_v<decltype(member), Vector3 StepRecord::*>) {
                series->add((record.*member).data(), 3);
            } else {
                series->add(static_cast<double>(record.*member));
            }
        };
        for (const StepColumn& column : step_columns) {
            if (!column.stored) continue;
            std::visit(add, column.value);
            ++series;
        }
        if (++waiting_ >= 1000) write();
    }

    void add_frame(const State& state, const std::vector<Pose>& poses, const std::vector<ContactRecord>& contacts) {
        std::size_t i = 0;
        frames_[i++].add(state.t);
        if (!state.q.empty()) {
            frames_[i++].add(state.q.data(), state.q.size());
            frames_[i++].add(state.v.data(), state.v.size());
        }
        for (const auto& pose : poses) {
            frames_[i].add(pose.position.data(), 3);
            frames_[i].add(pose.orientation.data(), 4);
        }
        const bool with_forces = contacts_.size() > 3;
        for (const auto& contact : contacts) {
            contacts_[0].add(contact.point.data(), 3);
            contacts_[1].add(contact.normal.data(), 3);
            contacts_[2].add(contact.gap);
            if (!with_forces) continue;
            for (const auto body : contact.bodies) contacts_[3].add(static_cast<double>(body));
            contacts_[4].add(contact.force.data(), 3);
        }
        contacts_before_ += static_cast<std::int64_t>(contacts.size());
        frames_.back().add(static_cast<double>(contacts_before_));
        waiting_ += 1 + static_cast<std::int64_t>((state.q.size() + contacts.size()) / 50);
        if (waiting_ >= 1000) write();
    }

    [[nodiscard]] std::vector<std::uint64_t> written() const {
        std::vector<std::uint64_t> sums;
        for (const auto* all : {&steps_, &frames_, &contacts_})
            for (const auto& series : *all) sums.push_back(series.written());
        return sums;
    }

    void cut() {
        for (auto* all : {&steps_, &frames_, &contacts_})
            for (auto& series : *all) series.cut();
    }

    /// act(series, its checksum) with each dataset of a file that is continued.
    template <class Act>
    void each_kept(const std::vector<std::uint64_t>& sums, Act&& act) {
        auto sum = sums.begin();
        if (sums.size() != steps_.size() + frames_.size() + contacts_.size())
            throw InputError(fmt::format("{}: the checkpoint is of a trajectory with other datasets", name_));
        for (auto* all : {&steps_, &frames_, &contacts_})
            for (auto& series : *all) act(series, *sum++);
    }

    void write() {
        std::uint64_t growth = 0, waiting = 0;
        for (const auto* all : {&steps_, &contacts_, &frames_})
            for (const auto& series : *all) {
                growth += series.growth();
                waiting += series.waiting();
            }
        if (growth == 0) return;
        hdf5::require_memory(growth);
        // What HDF5 still holds in its caches has no place in the file yet.
        reserve(file_, unflushed_ + growth, name_);
        unflushed_ += waiting;
        for (auto* all : {&steps_, &contacts_, &frames_})
            for (auto& series : *all) series.write();
        waiting_ = 0;
    }

private:
    hid_t file_;
    const std::string& name_;
    std::uint64_t& unflushed_;
    std::vector<Series> steps_, frames_, contacts_;
    std::int64_t waiting_ = 0, contacts_before_ = 0;
};

class Hdf5Writer : public TrajectoryWriter {
public:
    Hdf5Writer(const std::filesystem::path& path, const std::vector<TrajectorySystem>& systems, bool resume)
        : Hdf5Writer(path, systems, resume, H5F_ACC_RDWR) {
        uncut_ = resume;
        for (std::size_t i = 0; resume && i < systems.size(); ++i)
            systems_[i].each_kept(systems[i].written, [](Series& series, auto sum) { series.begin_from(sum); });
    }
    Hdf5Writer(const Hdf5Writer&) = delete;
    Hdf5Writer& operator=(const Hdf5Writer&) = delete;
    ~Hdf5Writer() override {
        if (!uncut_ && H5Fflush(file_.get(), H5F_SCOPE_LOCAL) >= 0) release_reserve(file_.get());
    }

    /// Throws InputError unless the file holds the rows to keep, as they were written. Changes nothing.
    static void require_kept(const std::filesystem::path& path, const std::vector<TrajectorySystem>& systems) {
        Hdf5Writer writer(path, systems, true, H5F_ACC_RDONLY);
        writer.uncut_ = true;
        for (std::size_t i = 0; i < systems.size(); ++i)
            writer.systems_[i].each_kept(systems[i].written,
                                         [](Series& series, auto sum) { series.require_kept(sum); });
    }

    void add_step(std::size_t system, const StepRecord& record) override {
        cut();
        systems_[system].add_step(record);
    }
    void add_frame(std::size_t system, const State& state, const std::vector<Pose>& poses,
                   const std::vector<ContactRecord>& contacts) override {
        cut();
        systems_[system].add_frame(state, poses, contacts);
    }
    [[nodiscard]] std::vector<std::uint64_t> written(std::size_t system) const override {
        return systems_[system].written();
    }
    void flush() override {
        cut();
        for (auto& system : systems_) system.write();
        if (H5Fflush(file_.get(), H5F_SCOPE_LOCAL) < 0)
            throw InputError(fmt::format("{}: the trajectory cannot be written", name_));
        unflushed_ = 0;
    }

private:
    Hdf5Writer(const std::filesystem::path& path, const std::vector<TrajectorySystem>& systems, bool resume,
               unsigned access)
        : name_(path.string()),
          file_(made(resume ? H5Fopen(path.c_str(), access, H5P_DEFAULT)
                            : H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT),
                     name_)) {
        if (!resume) {
            std::uint64_t bytes = 0;
            for (const auto& system : systems) bytes += largest_size(system.model);
            reserve(file_.get(), bytes, name_);
            put_text(file_.get(), "format", "delassus-trajectory", name_);
            put_number(file_.get(), "version", 1.0, name_);
        }
        const Handle group = group_in(file_.get(), "systems", resume, name_);
        systems_.reserve(systems.size());
        for (const auto& system : systems)
            systems_.emplace_back(file_.get(), group.get(), system, resume, name_, unflushed_);
    }

    /// Of a file that is continued, what was written after the checkpoint goes with the first new row.
    void cut() {
        if (!std::exchange(uncut_, false)) return;
        for (auto& system : systems_) system.cut();
    }

    std::string name_;
    Handle file_;
    std::uint64_t unflushed_ = 0;  // bytes written since the last flush
    bool uncut_ = false;           // continued, and as it was found
    std::vector<SystemFile> systems_;
};

}  // namespace
}  // namespace delassus::trajectory

extern "C" DELASSUS_API delassus::TrajectoryWriter* delassus_trajectory_open(
    const std::filesystem::path& file, const std::vector<delassus::TrajectorySystem>& systems, bool resume) {
    delassus::hdf5::require_memory();
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // failures become sentences
    if (resume) {
        const auto check = [&](delassus::hdf5::Packer&) {
            delassus::trajectory::Hdf5Writer::require_kept(file, systems);
        };
        delassus::hdf5::read_isolated(file, check, [](delassus::hdf5::Unpacker&) {});
    }
    return new delassus::trajectory::Hdf5Writer(file, systems, resume);
}
