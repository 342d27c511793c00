/* Several threads of a C++ program ask one surrogate at once, and each gets its own answers. */
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "coldplate.h"

namespace {

void check(int code)
{
    if (code != COLDPLATE_DONE) {
        throw std::runtime_error(coldplate_error_text(code));
    }
}

/* A surrogate and the bytes that it reads. */
class Surrogate {
public:
    explicit Surrogate(const std::string &path)
    {
        std::ifstream file(path, std::ios::binary);
        bytes_.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
        coldplate_surrogate *opened = nullptr;
        check(coldplate_open(bytes_.data(), bytes_.size(), &opened));
        handle_.reset(opened);
    }

    /* The middle of the ranges, moved by a share of them. */
    std::vector<double> condition(double share) const
    {
        std::vector<double> x(coldplate_variables(handle_.get()));
        for (std::size_t v = 0; v < x.size(); ++v) {
            coldplate_entry own;
            check(coldplate_variable(handle_.get(), v, &own));
            x[v] = own.low + (0.5 + share) * (own.high - own.low);
        }
        return x;
    }

    /* Values, bands and the probability, in a row. */
    std::vector<double> answers(const std::vector<double> &x) const
    {
        std::vector<double> values(coldplate_points(handle_.get()));
        std::vector<coldplate_band> bands(values.size());
        coldplate_verdict verdict;
        check(coldplate_assess(handle_.get(), x.data(), x.size(), 0.95, values.data(), bands.data(), values.size(), &verdict));
        for (const coldplate_band &band : bands) {
            values.push_back(band.total);
        }
        values.push_back(static_cast<double>(verdict.state));
        return values;
    }

private:
    struct Close {
        void operator()(coldplate_surrogate *own) const { coldplate_close(own); }
    };

    std::vector<unsigned char> bytes_;
    std::unique_ptr<coldplate_surrogate, Close> handle_;
};

} /* namespace */

int main(int count, char **words)
{
    if (count != 2) {
        std::fprintf(stderr, "usage: threads FILE.cps\n");
        return EXIT_FAILURE;
    }
    try {
        const Surrogate surrogate(words[1]);
        const int threads = 4;
        const int each = 2000;
        std::vector<std::vector<std::vector<double>>> found(threads);
        std::vector<std::thread> all;
        for (int own = 0; own < threads; ++own) {
            all.emplace_back([&surrogate, &found, own] {
                for (int k = 0; k < each; ++k) {
                    const double share = 0.4 * static_cast<double>(k * threads + own) / (threads * each);
                    found[static_cast<std::size_t>(own)].push_back(surrogate.answers(surrogate.condition(share)));
                }
            });
        }
        for (std::thread &own : all) {
            own.join();
        }
        for (int own = 0; own < threads; ++own) {
            for (int k = 0; k < each; ++k) {
                const double share = 0.4 * static_cast<double>(k * threads + own) / (threads * each);
                if (surrogate.answers(surrogate.condition(share)) != found[static_cast<std::size_t>(own)][static_cast<std::size_t>(k)]) {
                    std::fprintf(stderr, "thread %d, question %d: another answer\n", own, k);
                    return EXIT_FAILURE;
                }
            }
        }
        std::printf("%d answers in %d threads\n", threads * each, threads);
    } catch (const std::runtime_error &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return EXIT_FAILURE;
    }
    return EXIT_SUCCESS;
}
