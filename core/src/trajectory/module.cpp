// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <utility>

#include "delassus/error.hpp"
#include "delassus/export.hpp"
#include "trajectory/trajectory.hpp"

namespace delassus {
namespace {

/// An HDF5 identifier of any kind; closed with its owner.
class Handle {
public:
    Handle(hid_t id, const std::string& file) : id_(id) {
        if (id < 0) throw InputError(fmt::format("{}: HDF5 cannot write or continue the trajectory", file));
    }
    Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)) {}
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
    ~Handle() {
        if (id_ >= 0) H5Idec_ref(id_);
    }
    [[nodiscard]] hid_t get() const { return id_; }

private:
    hid_t id_;
};

void put_text(hid_t object, const char* name, const std::string& text, const std::string& file) {
    const Handle type(H5Tcopy(H5T_C_S1), file);
    H5Tset_size(type.get(), std::max<std::size_t>(1, text.size()));
    H5Tset_cset(type.get(), H5T_CSET_UTF8);
    const Handle space(H5Screate(H5S_SCALAR), file);
    const Handle attribute(H5Acreate2(object, name, type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT), file);
    H5Awrite(attribute.get(), type.get(), text.data());
}

void put_number(hid_t object, const char* name, double value, const std::string& file) {
    const Handle space(H5Screate(H5S_SCALAR), file);
    const Handle attribute(H5Acreate2(object, name, H5T_IEEE_F64LE, space.get(), H5P_DEFAULT, H5P_DEFAULT), file);
    H5Awrite(attribute.get(), H5T_NATIVE_DOUBLE, &value);
}

void put_names(hid_t group, const std::vector<std::string>& names, const std::string& file) {
    if (names.empty()) return;
    std::size_t length = 1;
    for (const auto& name : names) length = std::max(length, name.size());
    std::string block;
    for (const auto& name : names) {
        block += name;
        block.resize(block.size() + length - name.size(), '\0');
    }
    const Handle type(H5Tcopy(H5T_C_S1), file);
    H5Tset_size(type.get(), length);
    H5Tset_cset(type.get(), H5T_CSET_UTF8);
    H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
    const hsize_t count = names.size();
    const Handle space(H5Screate_simple(1, &count, nullptr), file);
    const Handle set(H5Dcreate2(group, "bodies", type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), file);
    H5Dwrite(set.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, block.data());
}

struct Column {
    const char* name;
    const char* unit;
    const char* description;
    bool integer = false;
};

/// A dataset that grows by rows. Rows wait in memory until write().
class Series {
public:
    /// shape: of one row. rows: to keep of a dataset that is there; a new one otherwise.
    Series(hid_t group, const Column& column, std::vector<hsize_t> shape, bool resume, std::int64_t rows,
           const std::string& file)
        : file_(file), shape_(std::move(shape)), set_(resume ? open(group, column, rows) : create(group, column)) {
        rows_ = resume ? static_cast<hsize_t>(rows) : 0;
    }

    void add(double value) { waiting_.push_back(value); }
    void add(const double* values, std::size_t count) { waiting_.insert(waiting_.end(), values, values + count); }

    void write() {
        if (waiting_.empty()) return;
        hsize_t width = 1;
        for (const auto extent : shape_) width *= extent;
        const hsize_t count = waiting_.size() / width;
        std::vector<hsize_t> size = {rows_ + count}, start = {rows_}, block = {count};
        for (const auto extent : shape_) {
            size.push_back(extent);
            start.push_back(0);
            block.push_back(extent);
        }
        bool written = H5Dset_extent(set_.get(), size.data()) >= 0;
        const Handle space(H5Dget_space(set_.get()), file_);
        const Handle memory(H5Screate_simple(static_cast<int>(block.size()), block.data(), nullptr), file_);
        written = written &&
                  H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start.data(), nullptr, block.data(), nullptr) >= 0;
        written = written &&
                  H5Dwrite(set_.get(), H5T_NATIVE_DOUBLE, memory.get(), space.get(), H5P_DEFAULT, waiting_.data()) >= 0;
        if (!written) throw InputError(fmt::format("{}: the trajectory cannot be written", file_));
        rows_ += count;
        waiting_.clear();
    }

private:
    [[nodiscard]] Handle create(hid_t group, const Column& column) const {
        std::vector<hsize_t> size = {0}, most = {H5S_UNLIMITED}, chunk = {0};
        hsize_t width = 1;
        for (const auto extent : shape_) {
            size.push_back(extent);
            most.push_back(extent);
            chunk.push_back(extent);
            width *= extent;
        }
        chunk[0] = std::max<hsize_t>(1, 4096 / width);
        const Handle space(H5Screate_simple(static_cast<int>(size.size()), size.data(), most.data()), file_);
        const Handle creation(H5Pcreate(H5P_DATASET_CREATE), file_);
        H5Pset_chunk(creation.get(), static_cast<int>(chunk.size()), chunk.data());
        Handle set(H5Dcreate2(group, column.name, column.integer ? H5T_STD_I64LE : H5T_IEEE_F64LE, space.get(),
                              H5P_DEFAULT, creation.get(), H5P_DEFAULT),
                   file_);
        put_text(set.get(), "unit", column.unit, file_);
        put_text(set.get(), "description", column.description, file_);
        return set;
    }

    [[nodiscard]] Handle open(hid_t group, const Column& column, std::int64_t rows) const {
        Handle set(H5Dopen2(group, column.name, H5P_DEFAULT), file_);
        const Handle space(H5Dget_space(set.get()), file_);
        std::vector<hsize_t> size(static_cast<std::size_t>(std::max(0, H5Sget_simple_extent_ndims(space.get()))));
        H5Sget_simple_extent_dims(space.get(), size.data(), nullptr);
        if (size.size() != shape_.size() + 1 || !std::equal(shape_.begin(), shape_.end(), size.begin() + 1) ||
            size[0] < static_cast<hsize_t>(rows))
            throw InputError(
                fmt::format("{}: \"{}\" is shorter than the checkpoint says, or of another shape", file_, column.name));
        size[0] = static_cast<hsize_t>(rows);
        H5Dset_extent(set.get(), size.data());
        return set;
    }

    const std::string& file_;
    std::vector<hsize_t> shape_;
    Handle set_;
    hsize_t rows_ = 0;
    std::vector<double> waiting_;
};

Handle group_in(hid_t parent, const char* name, bool resume, const std::string& file) {
    return {
        resume ? H5Gopen2(parent, name, H5P_DEFAULT) : H5Gcreate2(parent, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
        file};
}

constexpr std::size_t step_columns = 12;

class SystemFile {
public:
    SystemFile(hid_t parent, const TrajectorySystem& system, bool resume, const std::string& file) {
        const Handle group = group_in(parent, system.name.c_str(), resume, file);
        if (!resume) {
            put_text(group.get(), "integrator", system.integrator, file);
            put_text(group.get(), "solver", system.solver, file);
            put_number(group.get(), "step", system.step, file);
            put_names(group.get(), system.bodies, file);
        }
        const Handle steps = group_in(group.get(), "steps", resume, file);
        const auto step = [&](const Column& column, std::vector<hsize_t> shape = {}) {
            steps_.emplace_back(steps.get(), column, std::move(shape), resume, system.steps, file);
        };
        steps_.reserve(step_columns);
        step({"t", "s", "time at the end of the step; the first row is the initial state"});
        step({"energy", "J", "kinetic and potential energy"});
        step({"momentum", "kg m/s", "linear momentum, world frame"}, {3});
        step({"angular_momentum", "kg m^2/s", "angular momentum about the origin, world frame"}, {3});
        step({"drift", "m, rad", "largest violation of a bilateral constraint"});
        step({"penetration", "m", "depth of the deepest contact where the step began"});
        step({"contacts", "1", "contacts and other unilateral blocks in the step's problem", true});
        step({"newton_iterations", "1", "linear or cone problems solved", true});
        step({"solver_iterations", "1", "iterations of the solver plugin", true});
        step({"natural", "1", "largest natural error of the step's solves"});
        step({"seconds", "s", "wall time of the step"});
        step({"solved", "1", "1 if every solve reached its tolerance", true});
        const Handle frames = group_in(group.get(), "frames", resume, file);
        const auto frame = [&](const Column& column, std::vector<hsize_t> shape = {}) {
            frames_.emplace_back(frames.get(), column, std::move(shape), resume, system.frames, file);
        };
        frames_.reserve(4);
        frame({"t", "s", "time"});
        if (system.positions > 0) {
            frame({"q", "m, 1", "positions: mass centre and unit quaternion w x y z of moving bodies, then nodes"},
                  {static_cast<hsize_t>(system.positions)});
            frame({"v", "m/s, rad/s", "velocities: of the mass centre, angular in the body frame; then nodes"},
                  {static_cast<hsize_t>(system.velocities)});
        }
        if (!system.bodies.empty())
            frame({"poses", "m, 1", "mass centre and unit quaternion w x y z of every body, fixed ones too"},
                  {system.bodies.size(), 7});
    }

    void add_step(const StepRecord& record) {
        std::size_t i = 0;
        steps_[i++].add(record.t);
        steps_[i++].add(record.energy);
        steps_[i++].add(record.momentum.data(), 3);
        steps_[i++].add(record.angular_momentum.data(), 3);
        steps_[i++].add(record.drift);
        steps_[i++].add(record.penetration);
        steps_[i++].add(static_cast<double>(record.contacts));
        steps_[i++].add(static_cast<double>(record.newton_iterations));
        steps_[i++].add(static_cast<double>(record.solver_iterations));
        steps_[i++].add(record.natural);
        steps_[i++].add(record.seconds);
        steps_[i++].add(record.solved ? 1.0 : 0.0);
        if (++waiting_ >= 1000) write();
    }

    void add_frame(const State& state, const std::vector<Pose>& poses) {
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
        waiting_ += 1 + static_cast<std::int64_t>(state.q.size() / 50);
        if (waiting_ >= 1000) write();
    }

    void write() {
        for (auto& series : steps_) series.write();
        for (auto& series : frames_) series.write();
        waiting_ = 0;
    }

private:
    std::vector<Series> steps_, frames_;
    std::int64_t waiting_ = 0;
};

class Hdf5Writer : public TrajectoryWriter {
public:
    Hdf5Writer(const std::filesystem::path& path, const std::vector<TrajectorySystem>& systems, bool resume)
        : name_(path.string()),
          file_(resume ? H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT)
                       : H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT),
                name_) {
        if (!resume) {
            put_text(file_.get(), "format", "delassus-trajectory", name_);
            put_number(file_.get(), "version", 1.0, name_);
        }
        const Handle group = group_in(file_.get(), "systems", resume, name_);
        systems_.reserve(systems.size());
        for (const auto& system : systems) systems_.emplace_back(group.get(), system, resume, name_);
    }

    void add_step(std::size_t system, const StepRecord& record) override { systems_[system].add_step(record); }
    void add_frame(std::size_t system, const State& state, const std::vector<Pose>& poses) override {
        systems_[system].add_frame(state, poses);
    }
    void flush() override {
        for (auto& system : systems_) system.write();
        if (H5Fflush(file_.get(), H5F_SCOPE_LOCAL) < 0)
            throw InputError(fmt::format("{}: the trajectory cannot be written", name_));
    }

private:
    std::string name_;
    Handle file_;
    std::vector<SystemFile> systems_;
};

}  // namespace
}  // namespace delassus

extern "C" DELASSUS_API delassus::TrajectoryWriter* delassus_trajectory_open(
    const std::filesystem::path& file, const std::vector<delassus::TrajectorySystem>& systems, bool resume) {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // failures become sentences
    return new delassus::Hdf5Writer(file, systems, resume);
}
