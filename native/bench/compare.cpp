// SPDX-License-Identifier: GPL-3.0-or-later
//
// Compares run time and error: bakes scenes with any set of method combinations and seeds, and
// writes one line of JSON per bake. Usage: see kUsage.
//
// The errors are those of the light per patch side (patch_light.h) relative to a reference bake
// with the same patches and many more bundles. They are therefore the noise and the bias of the
// method, without the discretisation. The reference is kept in the working folder.
//
// Each bake runs in its own process. Its peak memory is then measured separately, no bake starts
// with data or caches of another bake, and a bake that fails does not stop the others.
#include <signal.h>
#include <sys/wait.h>
#include <tbb/info.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "command.h"
#include "job/error.h"
#include "patch_light.h"
#include "scene_file.h"

namespace raybundle::bench {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr char kUsage[] =
    R"(usage: compare SCENE.json ... --run "name=value ..." [--run ...] [options]

  SCENE.json          of blend_tests/export_scene.py
  --run SETTINGS      one combination of settings by name (raybundle.h), the rest being defaults;
                      "label=TEXT" names it in the output, and x=NUMBER is copied there
  --runs FILE         combinations, one per line; lines that begin with # do not count
  --common SETTINGS   for all combinations, which may overrule it
  --seeds N           bakes each with the seeds 1 .. N (1); a seed goes once through all
                      combinations before the next one
  --reference-bundles N   of the reference, at least 10 times those of the runs (4096)
  --work FOLDER       where references are kept (build/compare)
  --out FILE          lines are appended to it (standard output)
  --tag TEXT          goes into each line
  --limit SECONDS     a bake that takes longer is stopped (120)

A fixed number of bundles: min_bundles and max_bundles equal. The first shot still aims at
target_error. Exit code 1 if any combination failed; the others are in the output.
)";

constexpr unsigned kReferenceSeconds = 1800;
constexpr int kFailed = 3;  // exit code of a bake that threw

struct Run {
    std::string label;
    Json x;  // null if not given
    Settings settings;
    Json given = Json::object();  // the named settings, as they were written
};

struct Options {
    std::vector<std::string> scenes;
    std::vector<Run> runs;
    int seeds = 1;
    int referenceBundles = 4096;
    fs::path work = "build/compare";
    std::string out, tag;
    unsigned limit = 120;
};

// ------------------------------------------------------------------------------------------------
// Settings by name
// ------------------------------------------------------------------------------------------------

template <class T>
bool isOfType(const Settings& settings, const std::string& name) {
    try {
        T value;
        settings.get(name, value);
        return true;
    } catch (const Error&) {
        return false;
    }
}

template <class T>
T number(const std::string& name, const std::string& text) {
    std::istringstream stream(text);
    T value;
    if (!(stream >> value) || stream.peek() != EOF)
        throw invalidArgument("setting \"" + name + "\": \"" + text +
                              "\" is no number of its type");
    return value;
}

void set(Settings& settings, const std::string& name, const std::string& value) {
    if (isOfType<int>(settings, name))
        settings.set(name, number<int>(name, value));
    else if (isOfType<float>(settings, name))
        settings.set(name, number<float>(name, value));
    else
        settings.set(name, value);
}

Run parseRun(const std::string& text) {
    Run run;
    std::istringstream words(text);
    for (std::string word; words >> word;) {
        const size_t equals = word.find('=');
        if (equals == std::string::npos)
            throw invalidArgument("\"" + word + "\" is not of the form name=value");
        const std::string name = word.substr(0, equals), value = word.substr(equals + 1);
        if (name == "label") {
            run.label = value;
        } else if (name == "x") {
            run.x = number<double>(name, value);
        } else {
            set(run.settings, name, value);
            run.given[name] = value;
        }
    }
    if (run.label.empty()) run.label = text;
    return run;
}

Options parseOptions(const std::vector<std::string>& arguments) {
    Options options;
    std::vector<std::string> texts;
    std::string common;
    auto takeOption = [&](const std::string& name, const std::string& value) {
        if (name == "--run") {
            texts.push_back(value);
        } else if (name == "--runs") {
            std::ifstream file(value);
            if (!file) throw invalidArgument("cannot read " + value);
            for (std::string line; std::getline(file, line);)
                if (line.find_first_not_of(" \t") != std::string::npos && line[0] != '#')
                    texts.push_back(line);
        } else if (name == "--common") {
            common = value + " ";
        } else if (name == "--seeds") {
            options.seeds = number<int>(name, value);
        } else if (name == "--reference-bundles") {
            options.referenceBundles = number<int>(name, value);
        } else if (name == "--work") {
            options.work = value;
        } else if (name == "--out") {
            options.out = value;
        } else if (name == "--tag") {
            options.tag = value;
        } else if (name == "--limit") {
            options.limit = number<unsigned>(name, value);
        } else {
            return false;
        }
        return true;
    };
    readArguments(
        arguments, [&](const std::string& scene) { options.scenes.push_back(scene); }, takeOption);
    for (const std::string& text : texts) options.runs.push_back(parseRun(common + text));
    if (options.scenes.empty() || options.runs.empty())
        throw invalidArgument("a scene and a run are needed");
    return options;
}

// ------------------------------------------------------------------------------------------------
// One bake, one process
// ------------------------------------------------------------------------------------------------

struct Outcome {
    Json result;  // null if the bake failed
    std::string failure;
};

std::string readAll(int file) {
    std::string text;
    char buffer[4096];
    for (ssize_t n; (n = read(file, buffer, sizeof buffer)) > 0;) text.append(buffer, size_t(n));
    return text;
}

void writeAll(int file, const std::string& text) {
    for (size_t done = 0; done < text.size();) {
        const ssize_t n = write(file, text.data() + done, text.size() - done);
        if (n <= 0) return;
        done += size_t(n);
    }
}

// Runs `work` in a child process, for at most `limit` seconds. The caller must not have started
// threads.
Outcome inProcessOfItsOwn(unsigned limit, const std::function<Json()>& work) {
    int ends[2];
    if (pipe(ends) != 0) throw std::runtime_error("no pipe");
    const pid_t child = fork();
    if (child < 0) throw std::runtime_error("no process");
    if (child == 0) {
        close(ends[0]);
        alarm(limit);
        int code = 0;
        try {
            writeAll(ends[1], work().dump());
        } catch (const std::exception& error) {
            writeAll(ends[1], error.what());
            code = kFailed;
        }
        _exit(code);
    }
    close(ends[1]);
    const std::string said = readAll(ends[0]);
    close(ends[0]);
    int status = 0;
    waitpid(child, &status, 0);
    if (WIFSIGNALED(status)) {
        if (WTERMSIG(status) == SIGALRM)
            return {nullptr, "took longer than " + std::to_string(limit) + " s"};
        return {nullptr, std::string("crashed: ") + strsignal(WTERMSIG(status))};
    }
    if (WEXITSTATUS(status) == kFailed) return {nullptr, said};
    if (WEXITSTATUS(status) != 0)
        return {nullptr, "ended with code " + std::to_string(WEXITSTATUS(status))};
    return {Json::parse(said), ""};
}

// ------------------------------------------------------------------------------------------------
// Reference and comparison
// ------------------------------------------------------------------------------------------------

uint64_t fnv1a(const std::string& text) {
    uint64_t hash = 0xcbf29ce484222325;
    for (unsigned char c : text) hash = (hash ^ c) * 0x100000001b3;
    return hash;
}

std::string contents(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

struct BenchScene {
    std::string name;
    std::string text;  // text of the file
    Scene scene;
};

// Returns the path of the reference of this scene with the patches of `run`. Makes the reference if
// it does not exist.
std::string reference(const BenchScene& scene, const Settings& run, const Options& options) {
    std::ostringstream key;
    key << scene.text << '\n'
        << run.patchSize << ' ' << run.maxPatches << ' ' << run.contacts << ' '
        << options.referenceBundles;
    std::ostringstream path;
    path << (options.work / scene.name).string() << '-' << std::hex << fnv1a(key.str()) << ".light";
    if (fs::exists(path.str())) return path.str();
    const Outcome outcome = inProcessOfItsOwn(kReferenceSeconds, [&] {
        const auto start = std::chrono::steady_clock::now();
        const PatchLight light = referenceLight(scene.scene, run, options.referenceBundles);
        writePatchLight(path.str(), light);
        const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
        std::fprintf(stderr, "reference of %s: %zu sides, %u bundles, noise %.2f %%, %.1f s\n",
                     scene.name.c_str(), light.size(), light.bundles, 100 * light.estimatedError,
                     seconds.count());
        return Json::object();
    });
    if (outcome.result.is_null())
        throw invalidArgument("the reference of " + scene.name + ": " + outcome.failure);
    return path.str();
}

Json toJson(const LightError& error) {
    return {{"noise", error.noise},
            {"bias", error.bias},
            {"maximum", error.maximum},
            {"p99", error.p99},
            {"area", error.area}};
}

Json bakeAndCompare(const BenchScene& scene, const Run& run, int seed, const Options& options,
                    const std::string& referencePath) {
    Bake bake;
    bake.settings = run.settings;
    bake.settings.seed = seed;
    bake.run(scene.scene);
    const Json report = Json::parse(bake.reportJson());
    const PatchLight light = patchLight(scene.scene, bake);
    const PatchLight truth = readPatchLight(referencePath);
    const int threads = run.settings.threads;
    return {{"tag", options.tag},
            {"scene", scene.name},
            {"label", run.label},
            {"x", run.x},
            {"settings", run.given},
            {"seed", seed},
            {"threads", threads > 0 ? threads : tbb::info::default_concurrency()},
            {"seconds", report.at("seconds")},
            {"patches", report.at("patches")},
            {"patch_area", bake.patches().totalArea / double(bake.patches().count())},
            {"scene_radius", bake.patches().radius},
            {"bundles", report.at("bundles")},
            {"lines", report.at("lines")},
            {"exchanges", report.at("exchanges")},
            {"rays", report.at("shadow_rays")},
            {"error", toJson(lightError(light, truth, Part::ALL))},
            {"error_unlit", toJson(lightError(light, truth, Part::UNLIT))},
            {"error_indirect", toJson(lightError(light, truth, Part::INDIRECT))},
            {"stated_error", report.at("estimated_error")},
            {"peak_memory_bytes", report.at("peak_memory_bytes")},
            {"reference", {{"bundles", truth.bundles}, {"stated_error", truth.estimatedError}}},
            {"warnings", report.at("warnings")},
            {"skipped", report.at("skipped")}};
}

// Returns whether all bakes succeeded.
bool compareAll(const Options& options) {
    fs::create_directories(options.work);
    std::ofstream file;
    if (!options.out.empty()) {
        file.open(options.out, std::ios::app);
        if (!file) throw invalidArgument("cannot write " + options.out);
    }
    std::ostream& out = options.out.empty() ? std::cout : file;

    std::vector<BenchScene> scenes;
    for (const std::string& path : options.scenes)
        scenes.push_back({fs::path(path).stem().string(), contents(path), readScene(path)});
    std::set<std::pair<size_t, size_t>> failed;  // pairs of scene and run
    for (int seed = 1; seed <= options.seeds; ++seed)
        for (size_t s = 0; s < scenes.size(); ++s)
            for (size_t r = 0; r < options.runs.size(); ++r) {
                if (failed.count({s, r})) continue;
                const std::string path = reference(scenes[s], options.runs[r].settings, options);
                const Outcome outcome = inProcessOfItsOwn(options.limit, [&] {
                    return bakeAndCompare(scenes[s], options.runs[r], seed, options, path);
                });
                if (outcome.result.is_null()) {
                    failed.insert({s, r});
                    std::fprintf(stderr, "skipped %s, seed %d, %s %s: %s\n", scenes[s].name.c_str(),
                                 seed, options.runs[r].label.c_str(),
                                 options.runs[r].given.dump().c_str(), outcome.failure.c_str());
                } else {
                    out << outcome.result.dump() << std::endl;
                }
            }
    return failed.empty();
}

}  // namespace
}  // namespace raybundle::bench

int main(int count, char** values) {
    using namespace raybundle::bench;
    return runCommand("compare", kUsage, count, values, [](const auto& arguments) {
        return compareAll(parseOptions(arguments)) ? 0 : 1;
    });
}
