// SPDX-License-Identifier: GPL-3.0-or-later
//
// Runs a fuzz target on saved inputs without libFuzzer, so that the tests can run it with any
// compiler:
//   replay_... FILE_OR_FOLDER ...
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace {

void replay(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    std::fprintf(stderr, "%s\n", path.filename().c_str());
    LLVMFuzzerTestOneInput(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
}

}  // namespace

int main(int count, char** arguments) {
    size_t inputs = 0;
    for (int k = 1; k < count; ++k) {
        if (!std::filesystem::is_directory(arguments[k])) {
            replay(arguments[k]);
            ++inputs;
            continue;
        }
        for (const auto& entry : std::filesystem::directory_iterator(arguments[k])) {
            replay(entry.path());
            ++inputs;
        }
    }
    std::printf("%zu inputs\n", inputs);
    return inputs > 0 ? 0 : 1;
}
