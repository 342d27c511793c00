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

% Probability that all of some limits are kept: one after the other, each given those before (Mendell and Elston 1974).
function together = surrogate_all_kept(slack, broken, correlation)
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
    together = min(min(1 - broken), max(max(0, 1 - sum(broken)), together));
end

function s = surrogate_numbers()
    persistent numbers
    if isempty(numbers)
//! numbers
        numbers = s;
    end
    s = numbers;
end
