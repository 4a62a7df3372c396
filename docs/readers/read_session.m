function session = read_session(file)
% Reads session.h5, the sealed copy of a session, in MATLAB or GNU Octave.
%
%   session = read_session('P07/session.h5')
%
% session.readings has sequence, counter, status, time [s], received_ns (n x 1), raw and wrench (n x 6; Fx Fy Fz in N,
% Tx Ty Tz in N mm, nothing subtracted); session.events has time_ns, trial (0: none), kind and data (JSON texts);
% session.trials has number, score (NaN: none), outcome, descriptor, code; session.simulated is 'no', or says what was.
% docs/session-format.md tells every data set. Without an output the session is told in a few lines.
  if exist('h5read') > 0  % MATLAB
    get = @(name) h5read(file, ['/' name]);
  else  % GNU Octave reads HDF5 by itself
    all = load('-hdf5', file);
    get = @(name) getfield(getfield(all, strtok(name, '/')), name(find(name == '/') + 1:end));
  end
  columns = @(name) double(get(name)');  % HDF5 counts dimensions the other way round
  session.plan = jsondecode(text(get('head/plan')));
  session.transducer = jsondecode(text(get('head/transducer')));
  session.simulated = text(get('head/simulated'));  % a sentence, or no
  for name = {'sequence', 'counter', 'status', 'time', 'received_ns'}
    values = get(['readings/' name{1}]);
    session.readings.(name{1}) = values(:);
  end
  session.readings.raw = columns('readings/raw');
  if isstruct(session.transducer)
    session.readings.wrench = session.readings.raw * columns('calibration/matrix')';
  end
  for name = {'time_ns', 'trial', 'readings'}
    values = get(['events/' name{1}]);
    session.events.(name{1}) = values(:);
  end
  session.events.kind = texts(get('events/kind'));
  data = get('events/data');
  if isnumeric(data)  % bytes, one text after the other
    data = char(data(:)');
    stops = double(get('events/data_end'));
    starts = [0; stops(:)];
    session.events.data = arrayfun(@(a, b) data(a + 1:b), starts(1:end - 1), stops(:), 'UniformOutput', false);
  else  % format version 1
    session.events.data = texts(data);
  end
  for name = {'number', 'index', 'direction', 'score'}
    values = get(['trials/' name{1}]);
    session.trials.(name{1}) = values(:);
  end
  for name = {'outcome', 'descriptor', 'code'}
    session.trials.(name{1}) = texts(get(['trials/' name{1}]));
  end
  if nargout == 0
    tell(session);
    clear session
  end
end

function cells = texts(value)
% Texts are filled up with zero bytes to the length of the longest.
  cells = regexprep(strtrim(cellstr(value)), '\0+$', '');
end

function line = text(value)
  cells = texts(value);
  line = cells{1};
end

function tell(session)
  if ~strcmp(session.simulated, 'no')
    fprintf('%s\n', session.simulated);
  end
  fprintf('subject %s protocol %s\n', session.plan.subject, session.plan.protocol);
  fprintf('%d readings %d events\n', numel(session.readings.time), numel(session.events.kind));
  for i = 1:min(3, numel(session.readings.time))
    fprintf('reading %d at %.6f s: %s\n', session.readings.sequence(i), session.readings.time(i), ...
            strtrim(sprintf('%.9g ', session.readings.wrench(i, :))));
  end
  for i = 1:numel(session.trials.number)
    fprintf('trial %d score %g\n', session.trials.number(i), session.trials.score(i));
  end
end
