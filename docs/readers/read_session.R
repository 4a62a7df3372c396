# Reads a session that 'daq-app export SESSION --format csv' wrote, with R alone.
#
#   session <- read_session("P07-csv")
#   Rscript read_session.R P07-csv
#
# session$readings, $events, $trials, $answers, $strokes, $friction, $flaws and, where stored, $predictions are data frames;
# a column's name ends with its unit, and README.md of the export lists each. The file session.h5 of a session can
# be read too where Bioconductor's rhdf5 is installed: rhdf5::h5read("session.h5", "readings/raw"). The JSON text of event i
# is rawToChar(as.raw(data[(c(0, end)[i] + 1):end[i]])), with data and end from "events/data" and "events/data_end".

read_session <- function(folder) {
  files <- list.files(folder, pattern = "[.]csv$", full.names = TRUE)
  session <- lapply(files, read_table)
  names(session) <- sub("[.]csv$", "", basename(files))
  first <- readLines(file.path(folder, "README.md"), n = 1, encoding = "UTF-8")
  session$simulated <- if (startsWith(first, "SIMULATED")) first else NULL
  session
}

read_table <- function(file) read.csv(file, na.strings = "", encoding = "UTF-8")

if (!interactive() && length(commandArgs(trailingOnly = TRUE)) == 1) {
  session <- read_session(commandArgs(trailingOnly = TRUE))
  if (!is.null(session$simulated)) cat(session$simulated, "\n", sep = "")
  cat(nrow(session$readings), "readings", nrow(session$events), "events\n")
  for (i in seq_len(min(3, nrow(session$readings)))) {
    row <- session$readings[i, ]
    wrench <- unlist(row[c("Fx_N", "Fy_N", "Fz_N", "Tx_Nmm", "Ty_Nmm", "Tz_Nmm")])
    cat(sprintf("reading %d at %.6f s: %s\n", row$sequence, row$time_s, paste(sprintf("%.9g", wrench), collapse = " ")))
  }
  for (i in seq_len(nrow(session$trials))) {
    cat(sprintf("trial %d score %g\n", session$trials$trial[i], session$trials$score[i]))
  }
}
