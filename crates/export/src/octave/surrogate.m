//! signature
//! help
%
% Written by coldplate. x holds one value per variable; confidence, 0.95 where it is left out, lies between one half and one.
%
%   values   one per point
%   bands    a row per point: standard deviations of the fit, of the parameters, of what the model misses, and of all
%   limits   a row per limit: value, largest value allowed, margin, probability that it is kept
%   verdict  state ("acceptable", "uncertain", "not_acceptable"), in_domain, binding (a row of limits, 0 without one),
%            probability that all limits together are kept
%
% Without arguments: true if the self-test vectors of the surrogate are reproduced.
    s = surrogate_numbers();
    if nargin == 0
        values = surrogate_self_test(s);
        return
    end
    if numel(x) ~= numel(s.low)
        error("coldplate:shape", "expected %d values, found %d", numel(s.low), numel(x));
    end
    if nargin < 2
        confidence = 0.95;
    end
    x = double(x(:).');
    [values, bands, direction, growth] = surrogate_bands(s, x);
    if nargout > 2
        [limits, verdict] = surrogate_judge(s, x, confidence, values, direction, growth);
    end
end

function ok = surrogate_self_test(s)
    ok = true;
    for test = 1:size(s.test_conditions, 1)
        [values, bands] = surrogate_bands(s, s.test_conditions(test, :));
        expected = s.test_values(test, :).';
        ok = ok && all(abs(values - expected) <= 1e-7 * max(1, abs(expected)));
//? uncertain
        expected = s.test_deviations(test, :).';
        ok = ok && all(abs(bands(:, 4) - expected) <= 1e-7 * max(1, expected));
//? end
    end
end

% The scaled variables of a model.
function u = surrogate_scaled(s, x, scalings)
    u = zeros(1, numel(x));
    for v = 1:numel(x)
        own = s.scalings(scalings(v), :);
        g = x(v);
        if own(4) == 1
            g = 1 / g;
        elseif own(4) == 2
            g = log(g);
        end
        u(v) = (g - own(1)) * own(2) + own(3);
    end
end

% The monomials of the terms, a column.
function m = surrogate_monomials(u, exponents)
    m = ones(size(exponents, 1), 1);
    for v = 1:numel(u)
        m = m .* u(v) .^ exponents(:, v);
    end
end

function values = surrogate_fit(s, x)
    values = zeros(numel(s.half_widths), 1);
    for k = 1:numel(s.polynomials)
        own = s.polynomials{k};
        m = surrogate_monomials(surrogate_scaled(s, x, own.scalings), own.exponents);
        values(own.points) = values(own.points) + own.coefficients.' * m;
    end
//? bases
    for k = 1:numel(s.bases)
        own = s.bases{k};
        u = surrogate_scaled(s, x, own.scalings);
        q = zeros(size(own.centres, 1), 1);
        for v = 1:numel(u)
            q = q + ((u(v) - own.centres(:, v)) * own.scales(v)) .^ 2;
        end
        switch own.kernel
            case 0
                phi = 0.5 * q .* log(max(q, realmin));
            case 1
                phi = q .* sqrt(q);
            case 2
                phi = sqrt(1 + q);
            otherwise
                phi = exp(-q);
        end
        values(own.points) = values(own.points) + own.weights.' * phi;
    end
//? end
end

% Values and bands of all points; a row of weights of the states per point, and what the distance from the measured
% conditions adds to the variance of what the model misses, as a share.
function [values, bands, direction, growth] = surrogate_bands(s, x)
    values = surrogate_fit(s, x);
    points = numel(values);
    fit = s.half_widths / 1.959963984540054;
//? uncertain
    m = surrogate_monomials(surrogate_scaled(s, x, s.slope_scalings), s.slope_exponents);
    direction = zeros(points, s.parameters + points + 1);
    for p = 1:points
        direction(p, 1:s.parameters) = m.' * s.slopes{p};
        direction(p, s.parameters + p) = s.missed_own(p);
        direction(p, end) = s.missed_common(p);
    end
    away = zeros(1, numel(x));
    counted = s.measured_halves > 0;
    away(counted) = (x(counted) - s.measured_centre(counted)) ./ s.measured_halves(counted);
    growth = (s.growth * sqrt(sum(away .^ 2))) ^ 2;
//? known
    values = values + direction * s.mean;
//? end
    bands = zeros(points, 4);
    for p = 1:points
        bands(p, :) = surrogate_band(s, direction(p, :), fit(p) ^ 2, growth);
    end
//? else
    direction = [];
    growth = 0;
    bands = [fit, zeros(points, 2), fit];
//? end
end
//? uncertain

% Covariance of two directions by the states, or by some of them.
function c = surrogate_covariance(s, a, b, states)
//? known
    c = a(states) * s.covariance(states, states) * b(states).';
//? else
    c = a(states) * b(states).';
//? end
end

% The variance that is new away from the measured conditions is that of the weights beyond the parameters.
function band = surrogate_band(s, direction, fit, growth)
    all_states = 1:numel(direction);
    missing = s.parameters + 1:numel(direction);
    new_there = growth * sum(direction(missing) .^ 2);
    parameters = surrogate_covariance(s, direction, direction, 1:s.parameters);
    misses = surrogate_covariance(s, direction, direction, missing);
//? known
    states = surrogate_covariance(s, direction, direction, all_states);
//? else
    states = parameters + misses;
//? end
    band = sqrt(max(0, [fit, parameters, misses + new_there, states + fit + new_there]));
end
//? end

function p = surrogate_below(z)
    p = 0.5 * erfc(-z / sqrt(2));
end

% What is limited, what it depends on (points with a sign), and the largest value allowed.
function [value, first, second] = surrogate_limited(limit, x, values)
    first = limit.points(1);
    second = 0;
    value = values(first);
    switch limit.kind
        case 1
            value = value - x(limit.variable);
        case 2
            second = limit.points(2);
            value = value - values(second);
        case 3
            own = values(limit.points);
            [high, a] = max(own);
            [low, b] = min(own);
            first = limit.points(a);
            second = limit.points(b);
            value = high - low;
            if ~all(isfinite(own))
                value = NaN;
            end
    end
end

function [limits, verdict] = surrogate_judge(s, x, confidence, values, direction, growth)
    count = numel(s.limits);
    limits = zeros(count, 4);
    verdict = struct("state", "uncertain", "in_domain", all(s.low <= x & x <= s.high), "binding", 0, "probability", NaN);
    if count == 0
        return
    end
    points = numel(values);
    fit = (s.half_widths / 1.959963984540054) .^ 2;
    variance = zeros(count, 1);
    signs = zeros(count, points);
    for k = 1:count
        [value, first, second] = surrogate_limited(s.limits{k}, x, values);
        if first ~= second
            signs(k, first) = 1;
            if second > 0
                signs(k, second) = -1;
            end
        end
//? uncertain
        band = surrogate_band(s, signs(k, :) * direction, (signs(k, :) .^ 2) * fit, growth);
        variance(k) = band(4) ^ 2;
//? else
        variance(k) = fit(first);
        if second > 0
            variance(k) = variance(k) + fit(second);
        end
//? end
        margin = s.limits{k}.maximum - value;
        deviation = sqrt(variance(k));
        if ~(isfinite(margin) && isfinite(deviation))
            probability = NaN;
        elseif deviation > 0
            probability = surrogate_below(margin / deviation);
        else
            probability = double(margin >= 0);
        end
        limits(k, :) = [value, s.limits{k}.maximum, margin, probability];
    end
    nowhere = find(isnan(limits(:, 4)), 1);
    if ~isempty(nowhere)
        verdict.binding = nowhere;
        return
    end
    [slack, order] = sort(limits(:, 3) ./ max(sqrt(variance), realmin));
    broken = 1 - limits(order, 4);
    followed = order(1:min(8, count));
    elsewhere = sum(broken(numel(followed) + 1:end));
    doubtful = 1;
    while doubtful < numel(followed) && broken(doubtful + 1) > 1e-12
        doubtful = doubtful + 1;
    end
    correlation = eye(doubtful);
//? uncertain
    for i = 1:doubtful
        for j = 1:i - 1
            a = signs(followed(i), :);
            b = signs(followed(j), :);
            da = a * direction;
            db = b * direction;
            scale = sqrt(variance(followed(i)) * variance(followed(j)));
            if scale > 0
                shared = surrogate_covariance(s, da, db, 1:numel(da)) + (a .* b) * fit;
                missing = s.parameters + 1:numel(da);
                shared = shared + growth * (da(missing) * db(missing).');
                correlation(i, j) = min(1, max(-1, shared / scale));
                correlation(j, i) = correlation(i, j);
            end
        end
    end
//? end
    together = surrogate_all_kept(slack(1:doubtful), broken(1:doubtful), correlation) - elsewhere;
    verdict.probability = max(0, together);
    verdict.binding = order(1);
    if verdict.in_domain
        if verdict.probability >= confidence
            verdict.state = "acceptable";
        elseif verdict.probability <= 1 - confidence
            verdict.state = "not_acceptable";
        end
    end
end

% Probability that all of some limits are kept: the bound, and of more than three limits an estimate where that is low.
function together = surrogate_all_kept(slack, broken, correlation)
    together = surrogate_least_kept(min(40, max(-40, -slack)), broken, correlation);
    if numel(slack) > 3 && together < 0.9
        more = min(surrogate_one_by_one(slack, correlation), min(1 - broken)) - together;
        together = together + max(0, more) * min(1, (0.9 - together) / (0.9 - 0.7));
    end
end

% Nodes and weights of Gauss and Legendre's rule between 0 and 1.
function [nodes, weights] = surrogate_rule()
    nodes = [0.009219682876640378 0.0479413718147626 0.11504866290284765 0.20634102285669126 ...
        0.31608425050090994 0.43738329574426554 0.5626167042557344 0.6839157494990901 ...
        0.7936589771433087 0.8849513370971523 0.9520586281852375 0.9907803171233596];
    weights = [0.023587668193255706 0.05346966299765953 0.08003916427167321 0.10158371336153287 ...
        0.1167462682691773 0.12457352290670134 0.12457352290670134 0.1167462682691773 ...
        0.10158371336153287 0.08003916427167321 0.05346966299765953 0.023587668193255706];
end

% The tangent of half the angle whose sine is r.
function tangent = surrogate_half_tangent(r)
    tangent = r / (1 + sqrt((1 - r) * (1 + r)));
end

% Correlation and its complement 1 - r^2 at a half tangent; the angle that a step of it adds.
function [r, left, step] = surrogate_turned(tangent)
    under = 1 + tangent ^ 2;
    r = 2 * tangent / under;
    left = ((1 - tangent ^ 2) / under) ^ 2;
    step = 2 / under;
end

function density = surrogate_density_of_two(a, b, r, left)
    density = exp(-0.5 * (a ^ 2 + b ^ 2 - 2 * r * a * b) / left);
end

% What a correlation that is not quite one takes from the probability that both are below.
function lost = surrogate_missing(a, b, r)
    lost = 0;
    finish = sqrt((1 - r) * (1 + r));
    apart = abs(a - b);
    if apart > 8 * finish || finish == 0
        return
    end
    lead = exp(-0.5 * a * b);
    bend = 0.5 - 0.125 * a * b;
    edge = exp(-0.5 * apart ^ 2 / finish ^ 2);
    flat = finish * edge - apart * sqrt(2 * pi) * surrogate_below(-apart / finish);
    curved = (finish ^ 3 * edge - apart ^ 2 * flat) / 3;
    [nodes, weights] = surrogate_rule();
    x = nodes * finish;
    cosine = sqrt((1 - x) .* (1 + x));
    whole = exp(-a * b ./ (1 + cosine)) ./ cosine;
    total = sum(weights .* exp(-0.5 * apart ^ 2 ./ x .^ 2) .* (whole - lead * (1 + bend * x .^ 2)));
    lost = (lead * (flat + bend * curved) + finish * total) / (2 * pi);
end

% Probability that two standard normal numbers of correlation r are below a and b, each by itself with below_a and below_b
% (Drezner and Wesolowsky 1990, Genz 2004).
function p = surrogate_both_below(a, b, r, below_a, below_b)
    if r > 0.9
        p = min(below_a, below_b) - surrogate_missing(a, b, r);
        return
    elseif r < -0.9
        p = max(0, below_a + below_b - 1) + surrogate_missing(a, -b, -r);
        return
    end
    finish = surrogate_half_tangent(r);
    [nodes, weights] = surrogate_rule();
    total = 0;
    for n = 1:numel(nodes)
        [here, left, step] = surrogate_turned(nodes(n) * finish);
        total = total + weights(n) * step * surrogate_density_of_two(a, b, here, left);
    end
    p = below_a * below_b + finish * total / (2 * pi);
end

% Probability that three are broken (Plackett 1954); below zero where two of them are the same quantity.
function all = surrogate_three(bound, broken, both, correlation, i, j, k)
    all = -1;
    far = abs([correlation(i, j), correlation(i, k), correlation(j, k)]);
    if far(3) >= far(1) && far(3) >= far(2)
        of = [i, j, k];
    elseif far(2) >= far(1)
        of = [j, i, k];
    else
        of = [k, i, j];
    end
    p = correlation(of(2), of(3));
    if abs(p) > 1 - 1e-9
        return
    end
    a = bound(of(1));
    b = bound(of(2));
    c = bound(of(3));
    to_b = surrogate_half_tangent(correlation(of(1), of(2)));
    to_c = surrogate_half_tangent(correlation(of(1), of(3)));
    [nodes, weights] = surrogate_rule();
    total = 0;
    for n = 1:numel(nodes)
        [r, left_r, step_r] = surrogate_turned(nodes(n) * to_b);
        [q, left_q, step_q] = surrogate_turned(nodes(n) * to_c);
        left = max(1e-14, left_r - q ^ 2 - p ^ 2 + 2 * p * q * r);
        with_b = (c * left_r - (q - p * r) * a - (p - q * r) * b) / sqrt(left_r * left);
        with_c = (b * left_q - (r - p * q) * a - (p - q * r) * c) / sqrt(left_q * left);
        of_b = surrogate_density_of_two(a, b, r, left_r) * surrogate_below(with_b);
        of_c = surrogate_density_of_two(a, c, q, left_q) * surrogate_below(with_c);
        total = total + weights(n) * (to_b * step_r * of_b + to_c * step_q * of_c);
    end
    most = min([both(i, j), both(i, k), both(j, k)]);
    all = min(most, max(0, broken(of(1)) * both(of(2), of(3)) + total / (2 * pi)));
end

% A probability that all are kept which is never too large (Hunter 1976, Worsley 1982; Bukszar and Prekopa 2001).
function kept = surrogate_least_kept(bound, broken, correlation)
    count = numel(bound);
    both = zeros(count);
    for i = 1:count
        for j = 1:i - 1
            least = min(broken(i), broken(j));
            if least > 1e-7
                p = surrogate_both_below(bound(i), bound(j), correlation(i, j), broken(i), broken(j));
                both(i, j) = min(least, max(0, p));
                both(j, i) = both(i, j);
            end
        end
    end
    first = ones(1, count);
    second = zeros(1, count);
    left = 2:count;
    kept = 1 - broken(1);
    while ~isempty(left)
        next = left(1);
        for k = left
            if both(k, first(k)) > both(next, first(next)) + 1e-9
                next = k;
            end
        end
        alone = broken(next) - both(next, first(next));
        if second(next) > 0 && min(alone, both(next, second(next))) > 1e-6
            three = surrogate_three(bound, broken, both, correlation, next, first(next), second(next));
            if three >= 0
                alone = alone + (three - both(next, second(next)));
            end
        end
        kept = kept - max(0, alone);
        left(left == next) = [];
        for k = left
            if both(k, next) > both(k, first(k)) + 1e-9
                second(k) = first(k);
                first(k) = next;
            elseif second(k) == 0 || both(k, next) > both(k, second(k)) + 1e-9
                second(k) = next;
            end
        end
    end
    kept = max(0, kept);
end

% About the probability that all of some limits are kept: one after the other, each given those before, as if what is left
% stayed normal (Mendell and Elston 1974).
function together = surrogate_one_by_one(slack, correlation)
    count = numel(slack);
    together = 1;
    for i = 1:count
        if isinf(slack(i)) && slack(i) > 0
            continue
        end
        own = surrogate_below(slack(i));
        together = together * own;
        if own < 1e-300
            together = 0;
            return
        end
        a = exp(-0.5 * slack(i) ^ 2) / sqrt(2 * pi) / own;
        loss = 0;
        if a > 0
            loss = a * (a + slack(i));
        end
        row = correlation(i, :);
        for j = i + 1:count
            left = 1 - row(j) ^ 2 * loss;
            if row(j) > 1 - 1e-9
                slack(j) = Inf;
            elseif left > 1e-12
                slack(j) = (slack(j) + row(j) * a) / sqrt(left);
            else
                slack(j) = slack(j) + row(j) * a;
            end
        end
        for j = i + 1:count
            for k = i + 1:count
                if j ~= k
                    scale = sqrt(max(1e-12, 1 - row(j) ^ 2 * loss) * max(1e-12, 1 - row(k) ^ 2 * loss));
                    correlation(j, k) = min(1, max(-1, (correlation(j, k) - row(j) * row(k) * loss) / scale));
                end
            end
        end
    end
end

function s = surrogate_numbers()
    persistent numbers
    if isempty(numbers)
//! numbers
        numbers = s;
    end
    s = numbers;
end
