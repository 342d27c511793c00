//! signature
//! help
%
% Written by coldplate. A state is a column of numbers that may be kept; x holds one value per variable.
%
%   state = surrogate_in_time("rest", x)                           the steady state
%   state = surrogate_in_time("temperature", value)                everything at one temperature
%   [state, values] = surrogate_in_time("step", state, seconds, x) what x has made of it after so many seconds, and what points read
%   values = surrogate_in_time("read", state, x)                   what points read
//! errors
    s = surrogate_time_numbers();
    switch what
        case "rest"
            first = [surrogate_steady(s, surrogate_condition(s, varargin{1})); 0];
        case "temperature"
            first = [s.at_zero + s.per_unit * surrogate_finite(varargin{1}); 0];
        case "step"
            x = surrogate_condition(s, varargin{3});
            first = surrogate_step(s, varargin{1}, surrogate_finite(varargin{2}), x);
            if nargout > 1
                values = surrogate_read(s, first, x);
            end
        case "read"
            first = surrogate_read(s, varargin{1}, surrogate_condition(s, varargin{2}));
        otherwise
            error("coldplate:what", "'%s' is none of rest, temperature, step and read", what);
    end
end

function x = surrogate_condition(s, x)
    if numel(x) ~= s.variables
        error("coldplate:shape", "expected %d values, found %d", s.variables, numel(x));
    end
    x = surrogate_finite(double(x(:).'));
end

function value = surrogate_finite(value)
    if ~all(isfinite(value))
        error("coldplate:number", "a condition, temperature or duration is no finite number");
    end
end

% The monomials of the terms, a column.
function m = surrogate_time_terms(s, x, scalings, exponents)
    m = ones(size(exponents, 1), 1);
    for v = 1:numel(x)
        own = s.scalings(scalings(v), :);
        g = x(v);
        if own(4) == 1
            g = 1 / g;
        elseif own(4) == 2
            g = log(g);
        end
        m = m .* ((g - own(1)) * own(2) + own(3)) .^ exponents(:, v);
    end
end

function steady = surrogate_steady(s, x)
    steady = s.steady_coefficients.' * surrogate_time_terms(s, x, s.steady_scalings, s.steady_exponents);
end

% A rational approximation of the exponential with one real pole, third order and L-stable (Norsett 1974), cut where its own
% estimate asks for it.
function state = surrogate_step(s, state, seconds, x)
    if seconds < 0
        error("coldplate:number", "a duration is negative");
    end
    pole = 0.435866521508459;
    third = 0.5 / pole ^ 2 - 1 / pole - (1 / pole - 1);
    second = 1 / pole - 1 - 2 * third;
    n = numel(s.reach);
    m = surrogate_time_terms(s, x, s.moving_scalings, s.moving_exponents);
    rates = reshape(s.rates.' * m, n, n);
    steady = surrogate_steady(s, x);
    away = state(1:n) - steady;
    next = state(n + 1);
    if next <= 0
        next = seconds;
    end
    left = seconds;
    known = -1;
    while left > 0
        is_last = next >= left * (1 - 1e-9);
        duration = next;
        if is_last
            duration = left;
        end
        if known ~= duration
            [lower, upper, order] = lu(eye(n) + pole * duration * rates);
            known = duration;
        end
        one = upper \ (lower \ (order * away));
        two = upper \ (lower \ (order * one));
        three = upper \ (lower \ (order * two));
        four = upper \ (lower \ (order * three));
        missed = 0.5 * (abs(one - 3 * two + 3 * three - four).' * s.reach);
        if missed > 1e-4 && duration > 1e-6 * seconds
            next = 0.5 * duration;
            continue
        end
        away = (1 - second - third) * one + second * two + third * three;
        left = left - duration;
        grown = duration;
        if missed < 0.05 * 1e-4
            grown = 2 * duration;
        end
        if is_last
            left = 0;
            next = max(grown, next);
        else
            next = grown;
        end
    end
    state = [steady + away; next];
end

function values = surrogate_read(s, state, x)
//! evaluate
    m = surrogate_time_terms(s, x, s.moving_scalings, s.moving_exponents);
    away = state(1:numel(s.reach)) - surrogate_steady(s, x);
    for p = 1:numel(values)
        values(p) = values(p) + (s.outputs{p}.' * m).' * away;
    end
end

function s = surrogate_time_numbers()
    persistent numbers
    if isempty(numbers)
//! numbers
        numbers = s;
    end
    s = numbers;
end
