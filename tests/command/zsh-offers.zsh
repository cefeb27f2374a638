# What an interactive zsh offers where Tab is pressed, one word a line.
# usage: zsh -f zsh-offers.zsh FOLDER_OF_COMPLETIONS SCRATCH 'delassus so'
zmodload zsh/zpty
zpty -b shell zsh -f -i
zpty -w shell "PS1= ; fpath=($1 \$fpath); autoload -Uz compinit; compinit -u -D; bindkey '^I' complete-word
compadd() {
  if [[ \${@[1,(i)(-|--)]} == *-(O|A|D)\\ * ]]; then builtin compadd \"\$@\"; return; fi
  local -a hits; builtin compadd -A hits \"\$@\"; print -rl -- \$hits >> $2/offered; builtin compadd \"\$@\"
}
ended() { touch $2/ended }; zle -N ended; bindkey '^X' ended"
zpty -w -n shell $3$'\t\x18'
for try in {1..600}; do
  [[ ! -e $2/ended ]] || break
  sleep 0.1
done
zpty -d shell
[[ -e $2/ended ]] || exit 1
sort -u $2/offered
