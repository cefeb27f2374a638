// SPDX-License-Identifier: BSD-3-Clause
// Solvers written in Python, for programs that are not Python: a python3 runs the class, and the calls of the border go
// to it and back through a socket (border_message.hpp). One process for each class, as long as this process lives.
#include <fmt/format.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "delassus/error.hpp"
#include "delassus/version.hpp"
#include "solver/border_message.hpp"
#include "solver/create_slots.hpp"
#include "solver/python_solvers.hpp"
#include "solver/sidecar.hpp"
#include "support/json.hpp"
#include "support/library_location.hpp"
#include "support/process_record.hpp"
#include "support/sentence.hpp"

namespace delassus {

namespace fs = std::filesystem;

namespace {

/// Arguments: the class, the folder it is imported from, then folders that may hold the package delassus.
constexpr const char* program_of_solver = R"(
import os, struct, sys
sys.path[:] = [folder for folder in sys.path if folder]  # never the working directory
try:
    import importlib.util
    if importlib.util.find_spec("delassus") is None:
        sys.path += sys.argv[3:]
    from delassus._serving import serve
except BaseException as error:
    text = b"E" + f"{sys.executable} cannot use the package delassus: {error}; DELASSUS_PYTHON names another Python".encode()
    os.write(0, struct.pack("=Q", len(text)) + text)
    sys.exit(1)
serve(sys.argv[1], sys.argv[2])
)";

constexpr const char* program_of_list = R"(
import importlib.metadata, json, os, struct, sys
sys.path[:] = [folder for folder in sys.path if folder]
rows = {}
for package in importlib.metadata.distributions():
    for point in package.entry_points:
        if point.group == "delassus.solvers":
            known = package.metadata
            rows.setdefault(point.name, {
                "name": point.name, "python": point.value, "version": package.version,
                "description": known.get("Summary") or "", "package": f"{known['Name']} {package.version}",
                "licence": (known.get("License-Expression") or known.get("License") or "unknown").split("\n")[0]})
text = b"L" + json.dumps(sorted(rows.values(), key=lambda row: row["name"])).encode()
sys.stdout.flush()
os.write(0, struct.pack("=Q", len(text)))
while text:
    text = text[os.write(0, text):]
)";

/// The python3 that is asked: that of DELASSUS_PYTHON, or the first of the path.
std::string python_program() {
    const char* chosen = std::getenv("DELASSUS_PYTHON");
    return chosen && *chosen ? chosen : "python3";
}

/// There is no such program.
class NoPython : public PluginError {
public:
    using PluginError::PluginError;
};

/// A python3 that runs a text, with a socket as its standard input; what it prints goes to standard error.
class Interpreter {
public:
    Interpreter(const char* text, const std::vector<std::string>& arguments) {
        std::array<int, 2> ends{};
        if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) refuse(errno);
        socket_ = ends[0];
        std::vector<std::string> words = {python_program(), "-c", text};
        words.insert(words.end(), arguments.begin(), arguments.end());
        std::vector<char*> pointers;
        for (auto& word : words) pointers.push_back(word.data());
        pointers.push_back(nullptr);
        posix_spawn_file_actions_t files;
        posix_spawn_file_actions_init(&files);
        posix_spawn_file_actions_adddup2(&files, ends[1], STDIN_FILENO);
        posix_spawn_file_actions_adddup2(&files, STDERR_FILENO, STDOUT_FILENO);
        posix_spawnattr_t attributes;
        posix_spawnattr_init(&attributes);
        sigset_t none, usual;
        sigemptyset(&none);
        sigemptyset(&usual);
        for (const int signal : {SIGINT, SIGTERM, SIGPIPE, SIGCHLD, SIGXFSZ}) sigaddset(&usual, signal);
        posix_spawnattr_setsigmask(&attributes, &none);
        posix_spawnattr_setsigdefault(&attributes, &usual);
        posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
        const int failure = posix_spawnp(&process_, words[0].c_str(), &files, &attributes, pointers.data(), environ);
        posix_spawnattr_destroy(&attributes);
        posix_spawn_file_actions_destroy(&files);
        close(ends[1]);
        if (failure != 0) {
            close(socket_);
            refuse(failure);
        }
    }
    Interpreter(const Interpreter&) = delete;
    Interpreter& operator=(const Interpreter&) = delete;
    /// It ends when the socket is closed.
    ~Interpreter() {
        close(socket_);
        wait_for_end();
    }

    [[nodiscard]] bool send(const Message& message) const { return send_message(socket_, message); }
    [[nodiscard]] std::optional<Message> receive() const { return receive_message(socket_); }

    /// How it ended, once it closed its end: "it ended by the signal Segmentation fault".
    [[nodiscard]] std::string end_of_process() {
        wait_for_end();
        return WIFSIGNALED(status_)
                   ? fmt::format("its process was ended by the signal \"{}\"", strsignal(WTERMSIG(status_)))
                   : fmt::format("its process ended with code {}", WEXITSTATUS(status_));
    }

private:
    [[noreturn]] static void refuse(int error_number) {
        const std::string sentence =
            fmt::format("{} cannot be started: {}", python_program(), std::strerror(error_number));
        if (error_number == ENOENT) throw NoPython(sentence);
        throw PluginError(sentence);
    }
    void wait_for_end() {
        while (process_ > 0 && waitpid(process_, &status_, 0) < 0 && errno == EINTR) {
        }
        process_ = 0;
    }
    int socket_ = -1;
    pid_t process_ = 0;
    int status_ = 0;
};

/// Folders that may hold the package delassus that goes with this library: those of an installation, and of pip's.
std::vector<std::string> package_folders() {
    std::vector<std::string> folders;
    const fs::path library = library_directory();
    for (fs::path folder = library; folder.has_relative_path(); folder = folder.parent_path()) {
        for (const fs::path& place : {folder / "python3" / "dist-packages", folder})
            if (std::error_code absent; fs::exists(place / "delassus" / package_file, absent))
                folders.push_back(place.string());
        if (folder == library.parent_path().parent_path()) break;
    }
    return folders;
}

/// A class of Python that runs in a process of its own, and its plugin. It lasts as long as this process.
class PythonClass {
public:
    explicit PythonClass(const PluginInfo& found)
        : found_(found), who_(fmt::format("the solver {} of {}", found.python, source_of(found))) {
        std::vector<std::string> arguments = {found.python, import_folder(found).string()};
        for (auto& folder : package_folders()) arguments.push_back(std::move(folder));
        interpreter_.emplace(program_of_solver, arguments);
        auto answer = interpreter_->receive();
        if (!answer) throw PluginError(fmt::format("{} cannot be loaded: {}", who_, interpreter_->end_of_process()));
        if (answer->kind() != 'L') throw PluginError(fmt::format("{} cannot be loaded: {}", who_, answer->text()));
        const std::string version = answer->take_text();
        if (version != DELASSUS_VERSION)
            throw PluginError(fmt::format("{} cannot be loaded: the package delassus of {} has version {}; this is {}",
                                          who_, python_program(), version, DELASSUS_VERSION));
        info_ = parse_sidecar(answer->take_text(), found.library.empty() ? fs::path("/") : found.library);
        if (found.python.ends_with(':')) found_.python = info_.python;
    }

    /// own_create: the function create() that is this class's own.
    std::shared_ptr<const Plugin> plugin(CreateFunction own_create) {
        for (const auto& row : info_.options)
            options_.push_back({row.key.c_str(), row.type, 0, row.default_value.c_str(), row.minimum, row.maximum,
                                nullptr, row.unit.c_str(), row.doc.c_str()});
        descriptor_.magic = DELASSUS_PLUGIN_MAGIC;
        descriptor_.abi_major = DELASSUS_ABI_MAJOR;
        descriptor_.abi_minor = DELASSUS_ABI_MINOR;
        descriptor_.struct_size = sizeof descriptor_;
        descriptor_.flags = info_.flags;
        descriptor_.name = info_.name.c_str();
        descriptor_.version = info_.version.c_str();
        descriptor_.description = info_.description.c_str();
        descriptor_.licence = info_.licence.c_str();
        descriptor_.capabilities = info_.capabilities;
        descriptor_.options = options_.data();
        descriptor_.option_count = static_cast<std::int32_t>(options_.size());
        descriptor_.create = own_create;
        descriptor_.destroy = [](void* solver) { delete static_cast<Object*>(solver); };
        descriptor_.analyze = [](void* solver, const delassus_problem* problem) {
            return static_cast<Object*>(solver)->call('A', *problem);
        };
        descriptor_.factorize = [](void* solver, const delassus_problem* problem) {
            return static_cast<Object*>(solver)->call('F', *problem);
        };
        descriptor_.solve = [](void* solver, const delassus_problem* problem, const delassus_request* request,
                               double* x, double* lambda, delassus_outcome* outcome) {
            return static_cast<Object*>(solver)->solve(*problem, *request, x, lambda, *outcome);
        };
        descriptor_.last_error = [](void* solver) {
            return solver ? static_cast<Object*>(solver)->error.c_str() : creation_error().c_str();
        };
        descriptor_.accepts = [](void* solver, const delassus_problem* problem, char* reason, std::int32_t capacity) {
            auto& self = *static_cast<Object*>(solver);
            if (self.call('Q', *problem) == DELASSUS_SOLVED) return 1;
            const auto length = std::min(self.error.size(), static_cast<std::size_t>(std::max(capacity, 1)) - 1);
            std::memcpy(reason, self.error.data(), length);
            reason[length] = '\0';
            return 0;
        };
        return Plugin::of(descriptor_, found_);
    }

    std::int32_t create(const delassus_option_value* values, std::int32_t count, void** solver) {
        auto made = std::make_unique<Object>(*this, ++objects_);
        Message message('C');
        message.put(made->number()).put(count);
        for (std::int32_t k = 0; k < count; ++k)
            message.put(std::string_view(values[k].key))
                .put(values[k].type)
                .put(values[k].integer)
                .put(values[k].real)
                .put(values[k].text ? std::string_view(values[k].text) : std::string_view());
        const std::lock_guard lock(mutex_);
        auto answer = ask(message);
        const std::int32_t status = made->status_of(answer);
        if (status == DELASSUS_SOLVED) {
            *solver = made.release();
        } else {
            creation_error() = made->error;
        }
        return status;
    }

private:
    /// A solver: an object of the class, behind the border's void*.
    class Object {
    public:
        Object(PythonClass& of, std::uint64_t number) : class_(of), number_(number) {}
        Object(const Object&) = delete;
        Object& operator=(const Object&) = delete;
        ~Object() {
            const std::lock_guard lock(class_.mutex_);
            static_cast<void>(class_.interpreter_->send(Message('D').put(number_)));
        }
        [[nodiscard]] std::uint64_t number() const { return number_; }

        /// The status and the sentence of an answer.
        std::int32_t status_of(std::optional<Message>& answer) {
            if (answer && answer->kind() == 'R') {
                const auto status = answer->take<std::int32_t>();
                error = answer->take_text();
                return status;
            }
            error = class_.interpreter_->end_of_process();
            return DELASSUS_ERROR;
        }

        std::int32_t call(char kind, const delassus_problem& problem) {
            const std::lock_guard lock(class_.mutex_);
            Message message(kind);
            message.put(number_);
            class_.sender_.put(message, problem);
            auto answer = class_.ask(message);
            return status_of(answer);
        }

        std::int32_t solve(const delassus_problem& problem, const delassus_request& request, double* x, double* lambda,
                           delassus_outcome& outcome) {
            const std::lock_guard lock(class_.mutex_);
            const auto n = static_cast<std::size_t>(problem.n), m = static_cast<std::size_t>(problem.m);
            Message message('S');
            message.put(number_);
            class_.sender_.put(message, problem);
            message.put(request.warm_start).put(request.tolerance).put(request.max_iterations).put(request.time_limit);
            message.put(static_cast<std::int32_t>(request.progress != nullptr));
            message.put(x, request.warm_start ? n : 0).put(lambda, request.warm_start ? m : 0);
            auto answer = class_.ask(message);
            while (answer && answer->kind() == 'P') {
                const auto iteration = answer->take<std::int64_t>();
                const auto velocities = answer->take_all<double>(), reactions = answer->take_all<double>();
                const bool with_velocities = velocities.size() == n && n > 0;
                const std::int32_t reply =
                    request.progress(request.progress_context, iteration, with_velocities ? velocities.data() : nullptr,
                                     reactions.data());
                answer = class_.ask(Message('>').put(reply));
            }
            outcome.iterations = outcome.analyses = outcome.factorizations = 0;
            outcome.residual = std::numeric_limits<double>::quiet_NaN();
            outcome.message = nullptr;
            outcome.status = status_of(answer);
            if (!answer) return outcome.status;
            outcome.iterations = answer->take<std::int64_t>();
            const auto new_x = answer->take_all<double>(), new_lambda = answer->take_all<double>();
            if (new_x.size() == n) std::copy(new_x.begin(), new_x.end(), x);
            if (new_lambda.size() == m) std::copy(new_lambda.begin(), new_lambda.end(), lambda);
            return outcome.status;
        }

        std::string error;

    private:
        PythonClass& class_;
        std::uint64_t number_;
    };

    static std::string source_of(const PluginInfo& info) {
        return info.library.empty() ? fmt::format("the Python package {}", info.installed_from) : info.library.string();
    }
    static std::string& creation_error() {
        thread_local std::string text;
        return text;
    }
    /// With the lock. Nothing if the process has ended.
    std::optional<Message> ask(const Message& message) {
        if (!interpreter_->send(message)) return std::nullopt;
        return interpreter_->receive();
    }

    PluginInfo found_, info_;
    std::string who_;
    std::optional<Interpreter> interpreter_;
    std::mutex mutex_;  ///< Python does one thing at a time
    std::uint64_t objects_ = 0;
    ProblemSender sender_;
    std::vector<delassus_option> options_;
    delassus_plugin_descriptor descriptor_{};
};

/// Never destroyed: solvers may be used until the process ends.
std::vector<PythonClass*>& python_classes() {
    static auto* const classes = new std::vector<PythonClass*>;
    return *classes;
}

std::int32_t create_of_class(std::size_t number, const delassus_option_value* values, std::int32_t count,
                             void** solver) {
    return python_classes()[number]->create(values, count, solver);
}

class PythonProcesses final : public PythonSolvers {
public:
    std::vector<PluginInfo> packaged() override {
        const ForeignCall call("python3", "while it listed its packages", ForeignCall::patience);
        std::optional<Interpreter> interpreter;
        try {
            interpreter.emplace(program_of_list, std::vector<std::string>());
        } catch (const NoPython&) {
            if (!std::getenv("DELASSUS_PYTHON")) return {};  // a machine without Python has no packages of it
            throw;
        }
        const auto answer = interpreter->receive();
        if (!answer)
            throw PluginError(fmt::format("{} cannot list the solvers of its packages: {}", python_program(),
                                          interpreter->end_of_process()));
        std::vector<PluginInfo> rows;
        try {
            for (const auto& row : parse_ordered_json(answer->text())) {
                PluginInfo info;
                info.name = row.at("name");
                info.python = row.at("python");
                info.version = row.at("version");
                info.description = row.at("description");
                info.licence = row.at("licence");
                info.installed_from = row.at("package");
                info.origin = PluginOrigin::PythonPackage;
                rows.push_back(std::move(info));
            }
        } catch (const nlohmann::json::exception& error) {
            throw PluginError(
                fmt::format("{} cannot list the solvers of its packages: {}", python_program(), sentence_of(error)));
        }
        return rows;
    }

    std::shared_ptr<const Plugin> load(const PluginInfo& info) override {
        const std::lock_guard lock(mutex_);
        auto& plugin = loaded_[info.python + '\n' + info.library.string()];
        if (plugin) return plugin;
        const ForeignCall call("the solver " + info.name, "while it was loaded", ForeignCall::patience);
        auto made = std::make_unique<PythonClass>(info);
        auto& classes = python_classes();
        if (classes.size() == most_created_plugins)
            throw PluginError(fmt::format("{} solvers of Python are loaded; there can be no more", classes.size()));
        plugin = made->plugin(create_slots<&create_of_class>[classes.size()]);
        classes.push_back(made.release());
        return plugin;
    }

private:
    std::mutex mutex_;
    std::map<std::string, std::shared_ptr<const Plugin>> loaded_;
};

std::unique_ptr<PythonSolvers>& chosen_python_solvers() {
    static auto* const chosen = new std::unique_ptr<PythonSolvers>(std::make_unique<PythonProcesses>());
    return *chosen;
}

}  // namespace

PythonSolvers& python_solvers() {
    return *chosen_python_solvers();
}

void use_python_solvers(std::unique_ptr<PythonSolvers> solvers) {
    chosen_python_solvers() = std::move(solvers);
}

fs::path import_folder(const PluginInfo& info) {
    if (info.library.empty()) return {};
    const fs::path folder = info.library.parent_path();
    return info.library.filename() == package_file ? folder.parent_path() : folder;
}

}  // namespace delassus
